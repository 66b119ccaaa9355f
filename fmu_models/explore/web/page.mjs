// The page: a state, controls that change it, and what is drawn of the motion that follows from it.
import { Engine } from "./engine.mjs";
import { begins, columns, drifts, extremes, findSection, holds, reading, sampling } from "./reading.mjs";
import { deal } from "./sweep.mjs";
import { Picture, brief } from "./plot.mjs";

const FRAME = 24; // ms of work for one picture, and for each part of a run that takes longer
const MOST_STEPS = 1e6; // of a run
const PERIODS = 60, SECONDS = 20, COARSE = 700, FINE = 1100;
const STOPS = 1000; // of a slider
const element = (id) => document.getElementById(id);
const make = (name, attributes = {}, ...children) => {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value !== null && value !== undefined) made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
};

export class Page {
  constructor(model, module) {
    this.model = model;
    this.module = module;
    this.engine = new Engine(module);
    this.at = columns(model);
    const rates = model.inputs.map((u) => ({ name: `${u.name}_rate`, value: 0, default: 0 }));
    this.settable = [...model.parameters, ...model.inputs, ...rates, ...model.states, ...model.memories];
    this.firstState = model.parameters.length + 2 * model.inputs.length;
    this.kept = [];
    this.rows = {};
    this.reset();
    this.build();
    this.restore(linked(), false);
    this.refresh();
    this.simulate();
    if (!linked()) this.leaveDrift();
  }

  // the first plane in which the motion stays, where that of the first coordinate is left again and again
  leaveDrift() {
    const tail = this.motion.rows.slice(this.motion.from);
    const stays = this.model.planes.findIndex(([i]) => !drifts(tail, this.at.states + i));
    if (stays > 0) this.set("plane", stays), this.refresh();
  }

  reset() {
    this.state = { values: Float64Array.from(this.settable, (q) => q.value), until: this.model.until, plane: 0, series: 0, section: null };
  }

  // state and its texts -----------------------------------------------------------------------------------------------

  changed(of, unless) {
    const found = {};
    of.forEach((q) => {
      const value = this.state.values[this.settable.indexOf(q)];
      if (value !== q[unless]) found[q.name] = value;
    });
    return found;
  }

  json() {
    const { until, plane, series, section } = this.state;
    const set = this.changed(this.settable, "value");
    return JSON.stringify({ model: this.model.name, version: this.model.version, set, until, plane, series, section });
  }

  // take a state from its JSON; a wrong one changes nothing and is told
  restore(text, tell = true) {
    if (!text) return;
    try {
      const given = JSON.parse(text);
      if (given.model !== this.model.name) throw new Error(`it is of the model '${given.model}', this page is of '${this.model.name}'`);
      this.reset();
      for (const [name, value] of Object.entries(given.set ?? {})) {
        const i = this.settable.findIndex((q) => q.name === name);
        if (i < 0 || !Number.isFinite(value)) throw new Error(`'${name}' = ${value} is no value of this model`);
        this.state.values[i] = value;
      }
      if (given.until > 0) this.state.until = given.until;
      if (this.model.planes[given.plane]) this.state.plane = given.plane;
      if (given.series < this.drawable().length) this.state.series = given.series;
      if (given.section) this.state.section = given.section;
      if (given.version !== this.model.version) this.note(`The state was saved by version ${given.version}; this page is of ${this.model.version}.`);
    } catch (error) {
      this.reset();
      this.note(`The state is not taken: ${error.message}.`);
      if (tell) this.refresh();
    }
  }

  command() {
    const { model } = this;
    if (!model.model) return "# the model was declared in Python; pass it to fmu_models.simulate";
    if (Object.keys(model.laws).length) return "# its laws are those of a scene: use the scene below";
    const quote = (text) => (/^[\w./:=+-]+$/.test(text) ? text : `'${text.replace(/'/g, "'\\''")}'`);
    const list = (option, found) => Object.entries(found).map(([name, value]) => ` ${option} ${name}=${value}`).join("");
    return `stickslip simulate ${quote(model.model)}${model.arguments ? ` ${model.arguments}` : ""}${list("--set", this.changed(model.parameters, "default"))}`
      + `${list("--input", this.changed(model.inputs, "default"))}${list("--start", this.changed([...model.states, ...model.memories], "default"))} --until ${this.until}`;
  }

  scene() {
    const { model } = this, text = JSON.stringify;
    const table = (name, found) => (Object.keys(found).length ? `\n[${name}]\n${Object.entries(found).map(([key, v]) => `${key} = ${typeof v === "string" ? text(v) : real(v)}`).join("\n")}\n` : "");
    const real = (v) => (Number.isInteger(v) && Math.abs(v) < 1e15 ? v.toFixed(1) : String(v).replace(/^(-?\d+)e/, "$1.0e"));
    return `title = ${text(model.title)}\nsource = ${text(`explored with stickslip ${model.version}`)}\nmodel = ${text(model.model)}\n`
      + (model.sceneContacts ? `contacts = ${text(model.sceneContacts)}\n` : "") + `stop_time = "${this.until} s"\n`
      + table("laws", model.laws) + table("free", this.changed(model.parameters, "default"))
      + table("drives", Object.fromEntries(model.inputs.map((u) => [u.name, this.state.values[this.settable.indexOf(u)]])))
      + table("start", this.changed([...model.states, ...model.memories], "default"));
  }

  drawable() {
    return [...this.model.states, ...this.model.outputs];
  }

  columnOf(k) {
    const n = this.model.states.length;
    return k < n ? this.at.states + k : this.at.outputs + k - n;
  }

  note(text) {
    element("note").textContent = text;
  }

  // controls ----------------------------------------------------------------------------------------------------------

  build() {
    const { model } = this;
    for (const [id, list] of [["parameters", model.parameters], ["inputs", model.inputs], ["start", [...model.states, ...model.memories]]]) {
      const box = element(id);
      box.hidden = !list.length;
      for (const q of list) box.append(this.slider(q));
    }
    const options = (select, names, chosen) => {
      names.forEach((name, i) => select.append(make("option", { value: i }, name)));
      select.value = chosen;
    };
    options(element("plane"), model.planes.map(([i, j]) => `${model.states[j].name} over ${model.states[i].name}`), 0);
    options(element("series-of"), this.drawable().map((q) => q.name), 0);
    options(element("over"), [...model.parameters, ...model.inputs].map((q) => q.name), 0);
    element("plane").onchange = (e) => this.set("plane", Number(e.target.value));
    element("series-of").onchange = (e) => this.set("series", Number(e.target.value));
    element("over").onchange = () => this.rangeOf();
    element("until").onchange = (e) => this.set("until", Number(e.target.value) > 0 ? Number(e.target.value) : null);
    element("keep").onclick = () => this.keep();
    element("clear").onclick = () => ((this.kept = []), this.draw());
    element("defaults").onclick = () => (this.reset(), this.refresh(), this.simulate());
    element("sweep").onclick = () => this.diagram();
    element("apply").onclick = () => (this.note(""), this.restore(element("state").value), this.refresh(), this.simulate());
    for (const button of document.querySelectorAll("[data-copy]")) button.onclick = () => this.copy(button.dataset.copy);
    for (const button of document.querySelectorAll("[data-save]")) button.onclick = () => this.save(button.dataset.save, button.dataset.as);
    this.pictures = Object.fromEntries(["portrait", "series", "section", "sweeps"].map((id) => [id, new Picture(element(id))]));
    element("portrait").onclick = (event) => this.startAt(...this.pictures.portrait.at(event.clientX, event.clientY));
    element("sweeps").onclick = (event) => this.choose(this.pictures.sweeps.at(event.clientX, event.clientY)[0]);
    addEventListener("resize", () => {
      for (const id in this.pictures) this.pictures[id].resize();
      this.draw();
    });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
    addEventListener("hashchange", () => {
      const text = linked();
      if (text && text !== this.json()) this.restore(text), this.refresh(), this.simulate();
    });
    this.rangeOf();
  }

  slider(q) {
    const index = this.settable.indexOf(q), id = `q${index}`, label = `${q.name}: ${q.meaning}${q.unit === "1" ? "" : `, ${q.unit}`}`;
    const range = make("input", { type: "range", min: 0, max: STOPS, step: 1, id, "aria-label": label, title: label });
    const entry = make("input", { type: "text", inputmode: "decimal", size: 9, "aria-label": `value of ${q.name}`, id: `${id}v` });
    const scale = make("button", { type: "button", "aria-pressed": "false", title: "logarithmic scale", "aria-label": `logarithmic scale of ${q.name}` }, "log");
    const row = { q, index, range, entry, scale, log: false };
    scale.disabled = !q.log;
    range.oninput = () => this.change(index, this.fromStop(row, Number(range.value)));
    entry.onchange = () => this.enter(row);
    scale.onclick = () => {
      row.log = !row.log;
      scale.setAttribute("aria-pressed", row.log);
      this.show(row);
    };
    this.rows[index] = row;
    return make("div", { class: "row" }, make("label", { for: id, title: label }, q.name, make("small", {}, q.meaning)), range, entry,
      make("span", { class: "unit" }, q.unit === "1" ? "" : q.unit), scale);
  }

  fromStop({ q, log }, stop) {
    const [low, high] = log ? q.log.map(Math.log) : [q.low, q.high];
    if (stop === 0) return log ? q.log[0] : q.low;
    if (stop === STOPS) return log ? q.log[1] : q.high;
    const value = low + ((high - low) * stop) / STOPS;
    return Number((log ? Math.exp(value) : value).toPrecision(6));
  }

  enter(row) {
    const value = Number(row.entry.value.trim().replace(",", "."));
    if (row.entry.value.trim() === "" || !Number.isFinite(value)) {
      this.note(`'${row.entry.value}' is not a number; ${row.q.name} stays as it is.`);
      return this.show(row);
    }
    this.note("");
    this.change(row.index, value);
  }

  show(row) {
    const value = this.state.values[row.index], { q, log } = row;
    const [low, high] = log ? q.log.map(Math.log) : [q.low, q.high];
    const place = ((log ? Math.log(Math.max(value, 1e-300)) : value) - low) / (high - low);
    row.range.value = Math.round(STOPS * Math.min(1, Math.max(0, place)));
    row.range.setAttribute("aria-valuetext", `${brief(value, 6)} ${q.unit === "1" ? "" : q.unit}`.trim());
    row.entry.value = String(value);
  }

  refresh() {
    for (const index in this.rows) this.show(this.rows[index]);
    element("plane").value = this.state.plane;
    element("series-of").value = this.state.series;
  }

  change(index, value) {
    this.state.values[index] = value;
    this.show(this.rows[index]);
    this.simulate();
  }

  set(name, value) {
    this.state[name] = value;
    if (name === "plane") this.state.section = null;
    this.simulate();
  }

  startAt(x, v) {
    const [i, j] = this.model.planes[this.state.plane];
    this.state.values[this.firstState + i] = Number(x.toPrecision(6));
    if (j !== i) this.state.values[this.firstState + j] = Number(v.toPrecision(6));
    this.refresh();
    this.simulate();
  }

  // the motion --------------------------------------------------------------------------------------------------------

  simulate() {
    const begin = performance.now();
    clearTimeout(this.later);
    this.note("");
    this.run(begin);
    if (!(this.period > 0) && this.motion.complete && this.motion.refused === null) {
      const from = this.motion.from, preferred = this.model.planes[this.state.plane][1];
      const known = this.state.section;
      const found = findSection(this.motion.rows, this.at, from, this.model, preferred);
      const meets = known && this.motion.points.length > 2;
      if (found && !meets && JSON.stringify(found) !== JSON.stringify(known)) {
        this.state.section = found;
        this.run(begin);
      }
    }
    this.draw();
    this.took = performance.now() - begin;
    if (!this.motion.complete) this.later = setTimeout(() => this.goOn(), 0);
    this.share();
  }

  run(begin) {
    const { engine, state } = this;
    const refused = engine.start(state.values);
    this.period = refused === null ? engine.period : 0;
    this.until = state.until ?? (this.period > 0 ? Number((PERIODS * this.period).toPrecision(6)) : SECONDS);
    const settled = this.period > 0 ? Math.max(this.until / 2, this.until - 12 * this.period) : 0.7 * this.until;
    this.plan = { settled, ...sampling(this.until, settled, this.period, COARSE, FINE) };
    engine.ask(this.plan.times, this.period > 0 ? null : state.section);
    engine.go(() => performance.now() - begin > FRAME);
    this.collect();
  }

  goOn() {
    const begin = performance.now();
    this.engine.go(() => performance.now() - begin > FRAME);
    this.collect();
    if (!this.motion.complete && this.engine.steps < MOST_STEPS) this.later = setTimeout(() => this.goOn(), 0);
    else if (!this.motion.complete) this.note(`Stopped at t = ${brief(this.motion.rows.at(-1)?.[0] ?? 0)} s after ${this.engine.steps} steps: ask for a shorter run.`);
    else if (!(this.period > 0) && !this.state.section) return this.simulate();
    this.draw();
  }

  collect() {
    const { engine, at, plan } = this, all = engine.rows, rows = [];
    for (let i = 0; i < all.length; i += at.count) rows.push(all.subarray(i, i + at.count));
    let from = rows.findIndex((row) => row[0] >= plan.settled);
    if (from < 0) from = 0;
    const points = this.period > 0 ? plan.strobes.filter((i) => i < rows.length).map((i) => rows[i]) : engine.crossings;
    this.motion = { rows, from, points, events: engine.events, complete: engine.status !== 1, refused: engine.refused };
  }

  // pictures ----------------------------------------------------------------------------------------------------------

  colours() {
    const style = getComputedStyle(document.documentElement);
    return Object.fromEntries(["ground", "ink", "line", "faint", "hold", "mark", "plus", "minus", "k0", "k1", "k2", "k3"].map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  }

  axis(q) {
    return q.unit === "1" ? q.name : `${q.name} (${q.unit})`;
  }

  draw() {
    if (!this.motion) return;
    this.read = reading(this.motion, this.at, this.model, this.motion.from);
    const colours = this.colours();
    this.drawPortrait(colours);
    this.drawSeries(colours);
    this.drawSection(colours);
    if (this.swept) this.drawSweep(colours);
    this.tell();
  }

  pairs(rows, i, j) {
    const made = new Float64Array(2 * rows.length);
    rows.forEach((row, k) => ((made[2 * k] = row[i]), (made[2 * k + 1] = row[j])));
    return made;
  }

  // stretches [from, to, ...] in which a contact is in a state that the test likes
  stretches(contact, likes) {
    const { rows, events, from } = this.motion, found = [];
    if (!rows.length) return found;
    const begin = rows[from][0], end = rows[rows.length - 1][0];
    let since = begin, state = rows[from][this.at.contacts + contact];
    for (const event of events) {
      if (event.contact !== contact || event.time <= begin || event.time > end) continue;
      if (likes(state)) found.push(since, event.time);
      since = event.time;
      state = event.after;
    }
    if (likes(state)) found.push(since, end);
    return found;
  }

  drawPortrait(colours) {
    const { rows, from, points } = this.motion, [i, j] = this.model.planes[this.state.plane];
    const [ci, cj] = [this.at.states + i, this.at.states + j], picture = this.pictures.portrait;
    const around = [...rows, ...this.kept.filter((one) => one.plane === this.state.plane).flatMap((one) => one.rows)];
    picture.begin({ x: [...extremes(around, ci), this.axis(this.model.states[i])], y: [...extremes(around, cj), this.axis(this.model.states[j])] }, colours);
    picture.line(this.pairs(rows.slice(0, from + 1), ci, cj), colours.faint, 1);
    this.kept.forEach((one, k) => one.plane === this.state.plane && picture.line(this.pairs(one.rows, ci, cj), colours[`k${k % 4}`], 1.2));
    const tail = rows.slice(from), line = this.pairs(tail, ci, cj), held = line.slice();
    picture.line(line, colours.line, 1.4);
    tail.forEach((row, k) => {
      const any = this.model.contacts.some((c, n) => c.kind !== "switch" && holds(c.kind, row[this.at.contacts + n]));
      if (!any) held[2 * k] = NaN;
    });
    picture.line(held, colours.hold, 2.6);
    picture.dots(this.pairs(points.slice(-64), ci, cj), colours.mark, 5);
    picture.draw();
  }

  drawSeries(colours) {
    const { rows, from } = this.motion, tail = rows.slice(from), column = this.columnOf(this.state.series);
    const picture = this.pictures.series, [low, high] = extremes(tail, column), lanes = this.model.contacts.length;
    const room = ((high - low) * 7 * lanes) / 100;
    picture.begin({ x: [tail[0]?.[0] ?? 0, tail.at(-1)?.[0] ?? 1, "time (s)"], y: [low - room, high, this.axis(this.drawable()[this.state.series])], exact: tail.length > 1 }, colours);
    this.model.contacts.forEach((contact, k) => {
      const lane = lanes - 1 - k;
      picture.shade(this.stretches(k, (s) => holds(contact.kind, s)), colours.hold, lane);
      if (contact.kind === "friction" || contact.kind === "switch" || contact.kind === "impact_friction") {
        picture.shade(this.stretches(k, (s) => s === 1), colours.plus, lane);
        picture.shade(this.stretches(k, (s) => s === -1), colours.minus, lane);
      } else {
        const ticks = this.motion.events.filter((e) => e.contact === k && begins(contact.kind, e)).flatMap((e) => [e.time, e.time]);
        picture.shade(ticks, colours.mark, lane);
      }
    });
    picture.line(this.pairs(tail, 0, column), colours.line, 1.4);
    picture.draw();
  }

  drawSection(colours) {
    const { points } = this.motion, [i, j] = this.model.planes[this.state.plane], picture = this.pictures.section;
    const states = this.model.states, strobe = this.period > 0;
    // points of a periodic motion differ by rounding: an axis no finer than a part of the motion
    const span = (all, column) => {
      const [low, high] = extremes(all, column), [least, most] = extremes(this.motion.rows.slice(this.motion.from), column);
      const edge = high - low < 1e-4 * (most - least) ? 0.05 * (most - least) : 0;
      return [low - edge, high + edge];
    };
    if (strobe) {
      const [ci, cj] = [this.at.states + i, this.at.states + j], late = points.slice(Math.floor(points.length / 3));
      picture.begin({ x: [...span(late, ci), this.axis(states[i])], y: [...span(late, cj), this.axis(states[j])] }, colours);
      picture.dots(this.pairs(late, ci, cj), colours.mark, 4);
    } else {
      const shown = this.state.section?.state === i ? j : i, column = this.at.states + shown;
      const late = points.slice(Math.floor(points.length / 3)), pairs = new Float64Array(Math.max(0, 2 * (late.length - 1)));
      for (let k = 0; k + 1 < late.length; k++) (pairs[2 * k] = late[k][column]), (pairs[2 * k + 1] = late[k + 1][column]);
      const range = span(late, column);
      picture.begin({ x: [...range, `${states[shown].name}, one crossing`], y: [...range, `${states[shown].name}, the next`] }, colours);
      picture.line([range[0], range[0], range[1], range[1]], colours.faint, 1);
      picture.dots(pairs, colours.mark, 4);
    }
    picture.draw();
    const { section } = this.state;
    element("section-of").textContent = strobe ? `Strobe at the period of the forcing, ${brief(this.period)} s`
      : section ? `Return map where ${states[section.state].name} crosses ${brief(section.level)} ${section.direction < 0 ? "downward" : "upward"}`
      : "No state crosses a level again and again";
  }

  tell() {
    const { read, motion, model } = this, list = element("readout");
    const rows = [["period", read.period ? `${read.period} × section, ${brief(read.seconds, 9)} s` : motion.complete ? "none found" : "…"],
      ["n-p-q word", read.word || "–"],
      ...model.contacts.map((c, i) => [c.kind === "stop" || c.kind === "impact" ? `${c.name} in contact` : `${c.name} sticks`, `${brief(100 * read.held[i], 4)} %`]),
      ...model.states.map((q, i) => [q.name, `${read.extremes[i].map((x) => brief(x, 6)).join(" to ")} ${q.unit === "1" ? "" : q.unit}`])];
    list.replaceChildren(...rows.flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, value)]));
    const why = element("refusal");
    why.hidden = motion.refused === null;
    why.textContent = motion.refused ?? "";
    const [i, j] = model.planes[this.state.plane], said = read.period ? `period ${read.period}, word ${read.word}` : "no period found";
    element("portrait").setAttribute("aria-label", `Phase portrait: ${model.states[j].name} over ${model.states[i].name}; ${said}. A click starts the motion there.`);
    element("series").setAttribute("aria-label", `${this.drawable()[this.state.series].name} over time, with the states of contacts shaded`);
    element("section").setAttribute("aria-label", `${element("section-of").textContent}; ${motion.points.length} points, ${said}`);
    element("until").placeholder = String(this.until);
    if (document.activeElement !== element("until")) element("until").value = this.state.until ?? "";
  }

  share() {
    element("state").value = this.json();
    element("command").value = this.command();
    element("scene").value = this.model.model ? this.scene() : "# the model was declared in Python";
    clearTimeout(this.linking);
    this.linking = setTimeout(() => {
      try {
        history.replaceState(null, "", `#${encodeURIComponent(this.json())}`);
      } catch { /* a frame without an address has no permalink */ }
    }, 200);
  }

  keep() {
    const { rows, from } = this.motion;
    this.kept = [...this.kept, { plane: this.state.plane, rows: rows.slice(from) }].slice(-8);
    this.draw();
  }

  // the diagram -------------------------------------------------------------------------------------------------------

  rangeOf() {
    const q = [...this.model.parameters, ...this.model.inputs][Number(element("over").value)];
    if (!q) return;
    element("from").value = q.low;
    element("to").value = q.high;
  }

  diagram() {
    const q = [...this.model.parameters, ...this.model.inputs][Number(element("over").value)];
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
      this.drawSweep(this.colours());
    });
    this.drawSweep(this.colours());
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

  // files and clipboard -----------------------------------------------------------------------------------------------

  async copy(id) {
    const box = element(id);
    box.select();
    try {
      await navigator.clipboard.writeText(box.value);
      this.note("Copied.");
    } catch {
      this.note(document.execCommand("copy") ? "Copied." : "The text is selected; copy it with the keyboard.");
    }
  }

  save(id, kind) {
    const link = (blob) => {
      const url = URL.createObjectURL(blob), a = make("a", { href: url, download: `${this.model.name}_${id}.${kind}` });
      a.click();
      setTimeout(() => URL.revokeObjectURL(url), 1000);
    };
    if (kind === "svg") link(new Blob([this.pictures[id].svg(element(id).getAttribute("aria-label"))], { type: "image/svg+xml" }));
    else element(id).toBlob(link, "image/png");
  }
}

// the state after the # of the address, "" where there is none that can be read
function linked() {
  try {
    return decodeURIComponent(location.hash.slice(1));
  } catch {
    return "";
  }
}

export async function open() {
  try {
    const module = await WebAssembly.compile(await unpacked("engine").arrayBuffer());
    element("still").hidden = true;
    element("live").hidden = false;
    globalThis.page = new Page(JSON.parse(element("model").textContent), module);
  } catch (error) {
    refuse(error.message);
    throw error;
  }
}
