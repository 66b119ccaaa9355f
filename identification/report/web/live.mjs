// The fitted model live over the measured portraits: sliders, and what changes with them.
import { Engine } from "../../../fmu_models/explorer/web/engine.mjs";
import { Picture, brief } from "../../../fmu_models/explorer/web/plot.mjs";
import { element, make, palette } from "../../../fmu_models/explorer/web/elements.mjs";
import { portraitOf, range } from "./processing.mjs";
import { aligned, compared } from "./portraits.mjs";

const FRAME = 24, PATIENCE = 150; // ms of work between two looks at the mouse; of the log that is shown
const MOST_STEPS = 3e6; // of a run
const MOMENT = 1e-6; // s, in which an acceleration is seen
const NUDGE = 1e-4; // rad/s to either side, for the damping of steady sliding
const STOPS = 1000; // of a slider

// an angle at this value of its speed, rad/s^2
function acceleration(engine, family, values, angle, speed) {
  const start = Float64Array.from(values);
  start[family.angle] = angle;
  start[family.speed] = speed;
  if (engine.start(start) !== null) throw new Error(engine.refused);
  engine.ask([MOMENT]);
  engine.go();
  return (engine.rows[family.speedColumn] - speed) / MOMENT;
}

// where the model slides steadily, and whether it comes back there: {rest, swing, words}, or null
function sliding(engine, family, values) {
  const J = values[family.places.J[0]], k = values[family.places.k[0]];
  let angle = 0, rest = Infinity;
  for (let i = 0; i < 3 && Math.abs(rest) > 1e-9; i++) {
    rest = (acceleration(engine, family, values, angle, 0) * J) / k;
    if (Math.abs(rest) > 1e-9) angle += rest;
  }
  if (Math.abs(rest) > 1e-6) return null;
  const [above, below] = [NUDGE, -NUDGE].map((speed) => acceleration(engine, family, values, angle, speed));
  return above < below ? { rest: angle, swing: 0, words: "steady sliding (from another start stick-slip)" } : null;
}

// the motion of the model at the drive speeds of a log, and the metrics; gives way in between
function* modelled(engine, family, log, given, late) {
  const values = Float64Array.from(given);
  for (const [contact, drive] of Object.entries(log.drives)) values[family.inputs[contact]] = drive;
  values[family.speed] = log.begin;
  if (engine.start(values) !== null) throw new Error(engine.refused);
  const count = Math.round(log.length / log.step) + 1, angle = new Float64Array(count), size = engine.n.rows;
  let steps = 0;
  for (let done = 0; done < count; done += size) {
    const times = Float64Array.from({ length: Math.min(size, count - done) }, (_, i) => family.levels.transient + (done + i) * log.step);
    engine.ask(times);
    while (!engine.go(late)) {
      if (steps + engine.steps > MOST_STEPS) throw new Error(`The motion is not known after ${MOST_STEPS} steps`);
      yield;
    }
    if (engine.refused) throw new Error(engine.refused);
    steps += engine.steps;
    for (let rows = engine.rows, i = 0; i < times.length; i++) angle[done + i] = rows[i * engine.n.columns + family.angleColumn];
  }
  const levels = { ...family.levels, half: log.half };
  let motion = portraitOf(angle, log.step, log.drives, levels);
  if (!log.measured.sequence?.length && motion.sequence?.length) motion = sliding(engine, family, values) ?? motion;
  return { motion, metrics: compared(log.measured, motion, family.levels) };
}

// numbers from the differences of their differences, in units
function unfolded(differences, unit) {
  let step = 0, at = 0;
  return Float64Array.from(differences, (d) => (at += step += d) * unit);
}

export class Live {
  constructor(families, modules) {
    this.families = families;
    this.engines = modules.map((module) => new Engine(module));
    for (const { logs } of families) {
      for (const { measured } of logs) if (measured.angle) for (const name of ["angle", "speed"]) measured[name] = unfolded(...measured[name]);
    }
    this.values = {}; // by name of a slider
    // timers of a frame out of sight are slowed down, messages are not
    const { port1, port2 } = new MessageChannel();
    this.next = port2;
    port1.onmessage = () => {
      this.posted = false;
      this.work(FRAME);
    };
    this.build();
    this.choose(0);
  }

  build() {
    const select = element("family");
    this.families.forEach((one, i) => select.append(make("option", { value: i }, Object.keys(one.inputs).join(" and "))));
    element("families").hidden = this.families.length < 2;
    select.onchange = () => this.choose(Number(select.value));
    element("log").oninput = () => this.look();
    element("fitted").onclick = () => {
      for (const q of this.family.sliders) this.values[q.name] = q.value;
      this.show();
      this.changed();
    };
    this.pictures = ["portrait", "residual"].map((id) => new Picture(element(id)));
    addEventListener("resize", () => {
      for (const picture of this.pictures) picture.resize();
      this.draw();
    });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  choose(number) {
    this.number = number;
    this.family = this.families[number];
    Object.assign(element("log"), { min: 0, max: this.family.logs.length - 1, value: 0 });
    this.controls = this.family.sliders.map((q) => this.slider(q));
    element("sliders").replaceChildren(...this.controls.map((one) => one.row));
    this.show();
    this.changed();
  }

  slider(q) {
    const unit = q.unit === "1" ? "" : q.unit, label = `${q.name}: ${q.meaning}${unit && `, ${unit}`}`;
    const slide = make("input", { type: "range", min: 0, max: STOPS, id: `s-${q.name}`, "aria-label": label, title: label });
    const entry = make("input", { type: "text", inputmode: "decimal", size: 9, "aria-label": `value of ${q.name}` });
    const set = (value) => {
      this.values[q.name] = value;
      this.show();
      this.changed();
    };
    this.values[q.name] ??= q.value;
    slide.oninput = () => {
      const stop = Number(slide.value);
      set(stop === 0 ? q.low : stop === STOPS ? q.high : Number((q.low + ((q.high - q.low) * stop) / STOPS).toPrecision(7)));
    };
    entry.onchange = () => {
      const text = entry.value.trim().replace(",", "."), value = Number(text);
      if (text !== "" && Number.isFinite(value)) return set(value);
      this.show();
      this.note(`'${text}' is not a number; ${q.name} stays as it is.`);
    };
    const row = make("div", { class: "row" }, make("label", { for: slide.id, title: label }, q.name, make("small", {}, q.meaning)),
      slide, entry, make("span", { class: "unit" }, unit), make("small", { class: "reach" }, `${brief(q.low)} to ${brief(q.high)}${q.known ? "" : " (how well it is known is not said)"}`));
    return { q, slide, entry, row };
  }

  show() {
    const outside = [];
    for (const { q, slide, entry } of this.controls) {
      const value = this.values[q.name];
      slide.value = Math.round((STOPS * (value - q.low)) / (q.high - q.low));
      slide.setAttribute("aria-valuetext", `${brief(value, 6)} ${q.unit === "1" ? "" : q.unit}`.trim());
      entry.value = brief(value, 7);
      if (value < q.low || value > q.high) outside.push(q.name);
    }
    this.note(outside.length ? `Outside of its interval: ${outside.join(", ")}.` : "");
  }

  note(text) {
    element("note").textContent = text;
  }

  get log() {
    return Number(element("log").value);
  }

  look() {
    if (this.results[this.log]) return this.draw();
    this.work(PATIENCE, [this.log, ...this.queue.filter((one) => one !== this.log)]);
  }

  // other values: the log that is shown first, then all others
  changed() {
    this.results = this.family.logs.map(() => null);
    this.work(PATIENCE, [this.log, ...this.family.logs.keys()].filter((one, i) => i === 0 || one !== this.log));
  }

  work(patience, queue = this.queue) {
    const { family } = this, begin = performance.now(), late = () => performance.now() - begin > patience;
    if (queue !== this.queue) this.current = null;
    this.queue = queue;
    while (this.queue.length && !late()) {
      const number = this.queue[0];
      this.late = late;
      try {
        this.current ??= modelled(this.engines[family.engine], family, family.logs[number], this.given(), () => this.late());
        const { value, done } = this.current.next();
        if (!done) continue;
        this.results[number] = value;
      } catch (error) {
        this.results[number] = { refused: error.message };
      }
      this.queue.shift();
      this.current = null;
      if (number === this.log) patience = FRAME;
    }
    this.draw();
    if (!this.queue.length || this.posted) return;
    this.posted = true;
    this.next.postMessage(null);
  }

  // values in the order of the engine
  given() {
    const values = Float64Array.from(this.family.values);
    for (const q of this.family.sliders) for (const place of this.family.places[q.name]) values[place] = this.values[q.name];
    return values;
  }

  get complete() {
    return !this.queue.length;
  }

  // pictures and words ------------------------------------------------------------------------------------------------

  draw() {
    const log = this.family.logs[this.log], result = this.results[this.log], colours = palette();
    const said = Object.entries(log.drives).map(([contact, w]) => `${contact} ${brief(w, 4)} rad/s`).join(", ");
    element("log").setAttribute("aria-valuetext", `${log.name}: ${said}`);
    element("which").textContent = `${log.name}: ${said}`;
    const model = result?.motion;
    this.portrait(log.measured, model, colours);
    this.residual(log.measured, model, colours);
    const why = element("refusal");
    why.hidden = !result?.refused;
    why.textContent = result?.refused ?? "";
    if (!result) return;
    const metrics = result.metrics ?? [];
    element("words").textContent = result.refused ? "" : `Measured: ${log.measured.words}; model: ${model.words}.`;
    element("metrics").replaceChildren(...metrics.map(({ name, value, limit, passed }) => {
      const shown = name === "same motion" ? (passed ? "yes" : "no") : `${brief(100 * value, 3)} %`;
      return make("tr", {}, make("th", { scope: "row" }, name), make("td", {}, shown), make("td", {}, limit ? `${brief(100 * limit, 3)} %` : ""), make("td", passed ? {} : { class: "mark" }, passed ? "kept" : "FAIL"));
    }));
    const passes = (one) => one.metrics?.every(({ passed }) => passed) ?? false;
    const known = this.results.filter(Boolean), count = known.filter(passes).length;
    element("verdict").textContent = result.refused ? "refused" : passes(result) ? "pass" : `FAIL: ${metrics.filter((m) => !m.passed).map((m) => m.name).join(", ")}`;
    element("all").textContent = known.length < this.results.length ? `${known.length} of ${this.results.length} drive speeds computed …` : `Agrees at ${count} of ${this.results.length} drive speeds.`;
    element("portrait").setAttribute("aria-label", `Phase portrait of ${log.name}. ${element("words").textContent} ${element("verdict").textContent}`);
  }

  portrait(measured, model, colours) {
    const all = [measured, model].filter(Boolean), picture = this.pictures[0];
    const ends = (name) => {
      const values = all.flatMap((one) => (one.angle ? [...one[name]] : [name === "angle" ? one.rest : 0]));
      return [Math.min(...values), Math.max(...values)];
    };
    picture.begin({ x: [...ends("angle"), "angle (rad)"], y: [...ends("speed"), "angular speed (rad/s)"] }, colours);
    for (const [one, colour, width] of [[measured, colours.faint, 6], [model, colours.line, 1.6]]) {
      if (one?.angle) picture.line([...one.angle, one.angle[0]].flatMap((x, i) => [x, one.speed[i % one.angle.length]]), colour, width);
      else if (one) picture.dots([one.rest, 0], colour, 2 * width + 4);
    }
    picture.draw();
  }

  // the model less the measured cycle at equal phase, in parts of the measured half ranges
  residual(measured, model, colours) {
    const picture = this.pictures[1], lines = [];
    if (measured.angle && model?.angle) {
      const scale = ["angle", "speed"].map((name) => range(measured[name]) / 2), n = measured.angle.length;
      const parts = [measured, model].map((one) => ({ x: one.angle.map((v) => v / scale[0]), y: one.speed.map((v) => v / scale[1]) }));
      const { shift } = aligned(...parts);
      for (const axis of ["x", "y"]) lines.push(Array.from(parts[0][axis], (v, i) => [i / n, 100 * (parts[1][axis][(i + n - shift) % n] - v)]).flat());
    }
    const heights = lines.flat().filter((_, i) => i % 2), most = Math.max(1, ...heights.map(Math.abs));
    picture.begin({ x: [0, 1, "share of a cycle"], y: [-most, most, "model less measured (%)"] }, colours);
    picture.line([0, 0, 1, 0], colours.faint, 1);
    lines.forEach((line, i) => picture.line(line, [colours.line, colours.hold][i], 1.4));
    picture.draw();
    element("residual").setAttribute("aria-label", lines.length ? `Model less measured over a cycle, at most ${brief(most, 2)} % of the half range` : "No two cycles to subtract");
  }
}

export async function open() {
  try {
    const data = JSON.parse(await unpacked("data").text()), modules = [];
    for (let i = 0; element(`engine${i}`); i++) modules.push(await WebAssembly.compile(await unpacked(`engine${i}`).arrayBuffer()));
    element("still").hidden = true;
    element("live").hidden = false;
    globalThis.live = new Live(data, modules);
  } catch (error) {
    refuse(error.message);
    throw error;
  }
}
