// The page: a state, controls that change it, and what is drawn of the motion that follows from it.
import { Engine } from "./engine.mjs";
import { columns, drifts, findSection, sampling } from "./reading.mjs";
import { Picture, brief } from "./plot.mjs";
import { element, make } from "./elements.mjs";
import { LAST } from "./pictures.mjs";
import { Diagrams } from "./diagram.mjs";

const FRAME = 14; // ms of work for one picture, and for each part of a run that takes longer
const MOST_STEPS = 1e6; // of a run
// steps of the section: of a run, of what is drawn of its beginning, of its settled part
const PERIODS = 60, OPENING = 6, SHOWN = 12;
const SECONDS = 20; // of a run whose period is not known
const COARSE = 400, FINE = 600; // samples of the beginning, and of the settled part and the finest each
const STOPS = 1000; // of a slider

export class Page extends Diagrams {
  constructor(model, module) {
    super();
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
    this.restore(linked());
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
    this.pace = null; // s, between crossings of the section
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
    const { plane, series, section } = this.state, until = this.until;
    const set = this.changed(this.settable, "value");
    return JSON.stringify({ model: this.model.name, version: this.model.version, set, until, plane, series, section });
  }

  // take a state from its JSON; a wrong one changes nothing and is told
  restore(text) {
    if (!text) return;
    const before = this.state, pace = this.pace;
    try {
      const given = JSON.parse(text);
      if (given.model !== this.model.name) throw new Error(`it is of the model '${given.model}', this page is of '${this.model.name}'`);
      this.reset();
      for (const [name, value] of Object.entries(given.set ?? {})) {
        const i = this.settable.findIndex((q) => q.name === name);
        if (i < 0 || !Number.isFinite(value)) throw new Error(`'${name}' = ${value} is no value of this model`);
        this.state.values[i] = value;
      }
      const index = (value, list) => (Number.isInteger(value) && value >= 0 && value < list.length ? value : 0);
      if (Number.isFinite(given.until) && given.until > 0) this.state.until = given.until;
      this.state.plane = index(given.plane, this.model.planes);
      this.state.series = index(given.series, this.drawable());
      const { state, level, direction } = given.section ?? {};
      if (index(state, this.model.states) === state && Number.isFinite(level)) this.state.section = { state, level, direction: direction < 0 ? -1 : 1 };
      if (given.version !== this.model.version) this.note(`The state was saved by version ${given.version}; this page is of ${this.model.version}.`);
    } catch (error) {
      [this.state, this.pace] = [before, pace];
      this.note(`The state is not taken: ${error.message}.`);
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
    options(element("over"), this.movable.map((q) => q.name), 0);
    element("plane").onchange = (e) => this.set("plane", Number(e.target.value));
    element("series-of").onchange = (e) => this.set("series", Number(e.target.value));
    element("over").onchange = () => (this.rangeOf(), this.diagram());
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
    // a page around this one sets the state by its JSON
    addEventListener("message", ({ source, data }) => {
      if (source === window || source !== parent || typeof data !== "string") return;
      this.note("");
      this.restore(data);
      this.refresh();
      this.simulate();
    });
    this.rangeOf();
    new IntersectionObserver((seen, observer) => {
      if (!seen.some(({ isIntersecting }) => isIntersecting)) return;
      observer.disconnect();
      this.seen = true;
      if (!this.swept) this.begin();
    }).observe(element("sweeps"));
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
    this.note("");
    this.state.values[index] = value;
    this.show(this.rows[index]);
    this.simulate();
  }

  set(name, value) {
    this.note("");
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
    this.run(begin);
    for (let k = 0; k < 3 && this.adapted(); k++) this.run(begin);
    this.draw();
    this.first ??= performance.now() - begin; // ms, of the first picture
    if (!this.motion.complete) this.later = setTimeout(() => this.goOn(), 0);
    this.share();
  }

  // whether the motion, once it is known to its end, asks to be looked at otherwise: at another section, or so long as
  // sixty of its steps take
  adapted() {
    if (this.period > 0 || !this.motion.complete || this.motion.refused !== null) return false;
    const { points } = this.motion, known = this.state.section, half = points.length >> 1;
    if (!known || points.length < 3) {
      const found = findSection(this.motion.rows, this.at, this.motion.from, this.model, this.model.planes[this.state.plane][1]);
      const other = found && JSON.stringify(found) !== JSON.stringify(known);
      if (other) this.state.section = found;
      return Boolean(other);
    }
    if (this.state.until !== null || this.pace !== null || points.length < 4) return false;
    this.pace = (points.at(-1)[0] - points[half][0]) / (points.length - 1 - half);
    return true;
  }

  run(begin) {
    const { engine, state } = this;
    const refused = engine.start(state.values);
    this.period = refused === null ? engine.period : 0;
    const turn = this.period > 0 ? this.period : this.pace;
    this.until = state.until ?? (turn ? Number((PERIODS * turn).toPrecision(3)) : SECONDS);
    const settled = turn ? Math.max(this.until / 2, this.until - SHOWN * turn) : 0.7 * this.until;
    const opening = turn ? Math.min(settled, OPENING * turn) : settled;
    const last = turn ? Math.max(settled, this.until - LAST * turn) : settled;
    const spans = { until: this.until, opening, settled, last, period: this.period };
    // while a slider moves the spans stay, as a rule
    if (Object.keys(spans).some((name) => spans[name] !== this.plan?.[name])) this.plan = { ...spans, ...sampling(spans, COARSE, FINE) };
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
    else if (this.adapted()) return this.simulate();
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

  // texts and what is kept ----------------------------------------------------------------------------------------------

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
