// The bifurcation diagram: many settled motions over one parameter, made by workers; a click takes a value to the page.
// It begins over what forces the motion, as soon as it is in view.
import { Engine } from "./engine.mjs";
import { deal } from "./sweep.mjs";
import { brief } from "./plot.mjs";
import { element, palette } from "./elements.mjs";
import { Pictures } from "./pictures.mjs";

export class Diagrams extends Pictures {
  draw() {
    super.draw();
    if (this.motion && this.swept) this.drawSweep(palette());
    else this.begin();
  }

  get movable() {
    return [...this.model.parameters, ...this.model.inputs];
  }

  rangeOf() {
    const q = this.movable[Number(element("over").value)];
    if (!q) return;
    element("from").value = q.low;
    element("to").value = q.high;
  }

  // around the value of what forces the motion; later, where nothing is seen or no motion is known to its end
  begin() {
    if (!this.seen || !this.motion?.complete || this.motion.refused !== null || !(this.period > 0 || this.state.section)) return;
    const k = this.forcing(), q = this.movable[k], value = this.state.values[this.settable.indexOf(q)];
    element("over").value = k;
    this.rangeOf();
    const [low, high] = [value / 2, (3 * value) / 2].map((end) => Number(Math.min(Math.max(end, q.low), q.high).toPrecision(6)));
    if (low < high) (element("from").value = low), (element("to").value = high);
    this.diagram();
  }

  // place of what forces the motion: the frequency, by which its period changes; what is said to force or to drive; an input
  forcing() {
    const { movable } = this, engine = new Engine(this.module), values = Float64Array.from(this.state.values);
    const period = () => (engine.start(values) === null ? engine.period : 0);
    for (let k = 0; this.period > 0 && k < this.model.parameters.length; k++) {
      values[k] *= 1.01;
      if (Math.abs(period() / this.period - 1) > 1e-6) return k;
      values[k] = this.state.values[k];
    }
    const said = movable.findIndex(({ meaning }) => /forcing|belt speed|speed of the|drive speed/.test(meaning));
    return said >= 0 ? said : this.model.inputs.length ? this.model.parameters.length : 0;
  }

  diagram() {
    const q = this.movable[Number(element("over").value)];
    const [low, high, count] = ["from", "to", "count"].map((id) => Number(element(id).value));
    if (!q || !Number.isFinite(low) || !Number.isFinite(high) || low === high || !(count >= 2 && count <= 2000)) {
      return this.note("A diagram goes over 2 to 2000 values from one number to another.");
    }
    if (!(this.period > 0) && !this.state.section) return this.note("This motion meets no section again and again, so that there is nothing to draw over a parameter.");
    const values = Float64Array.from({ length: count }, (_, i) => low + ((high - low) * i) / (count - 1));
    const index = this.settable.indexOf(q);
    const job = {
      base: this.state.values.slice(), over: index, values, transient: 140, keep: 40, section: this.period > 0 ? null : this.state.section,
      firstState: this.firstState, columns: this.at.count, states: this.model.states.length, memories: this.model.memories.length,
    };
    this.stop?.();
    const begin = performance.now(), cores = Math.max(1, Math.min(4, (navigator.hardwareConcurrency || 2)));
    this.swept = { q, index, values, points: new Map(), refused: new Map(), done: false, shown: this.section0() };
    element("progress").textContent = "computing …";
    this.stop = deal(this.module, job, Math.min(cores, count), ({ found, done, failed }) => {
      for (const one of found) {
        this.swept.points.set(one.index, one.points);
        if (one.refused) this.swept.refused.set(one.index, one.refused);
      }
      this.swept.done = done;
      const why = [...new Set(this.swept.refused.values())], n = this.swept.refused.size;
      element("progress").textContent = failed ? `Workers are not to be had here: ${failed}` : `${this.swept.points.size} of ${count} values${done ? ` in ${brief((performance.now() - begin) / 1000, 3)} s` : ""}${n ? `; ${n} refused, such as: ${why[0]}` : ""}`;
      this.drawSweep(palette());
    });
    this.drawSweep(palette());
  }

  // the state that a diagram shows: that of the plane which the section leaves free
  section0() {
    const [i, j] = this.model.planes[this.state.plane];
    return !(this.period > 0) && this.state.section?.state === i ? j : i;
  }

  drawSweep(colours) {
    const { q, index, values, points, shown } = this.swept, flat = [];
    for (const [k, found] of points) for (const point of found) flat.push(values[k], point[shown]);
    let low = Infinity, high = -Infinity;
    for (let i = 1; i < flat.length; i += 2) (low = Math.min(low, flat[i])), (high = Math.max(high, flat[i]));
    const picture = this.pictures.sweeps, ends = [values[0], values[values.length - 1]].sort((a, b) => a - b);
    picture.begin({ x: [...ends, this.axis(q)], y: [low, high, this.axis(this.model.states[shown])], exact: true }, colours);
    const now = this.state.values[index];
    if (Number.isFinite(low)) picture.line([now, low, now, high], colours.hold, 1);
    picture.dots(flat, colours.line, 1.5);
    picture.draw();
    element("sweeps").setAttribute("aria-label", `Bifurcation diagram: ${this.model.states[shown].name} at the section over ${q.name}; ${points.size} of ${values.length} values. A click sets ${q.name}.`);
  }

  choose(value) {
    if (!this.swept) return;
    const { values, index } = this.swept, ends = [values[0], values[values.length - 1]];
    this.change(index, Number(Math.min(Math.max(value, Math.min(...ends)), Math.max(...ends)).toPrecision(6)));
  }
}
