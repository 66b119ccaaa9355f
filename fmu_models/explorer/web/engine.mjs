// One motion at a time, in the WebAssembly that stands beside it (c/explore.h).

const SIZE = { parameters: 0, inputs: 1, states: 2, outputs: 3, contacts: 4, values: 5, rows: 7, crossings: 8, columns: 11, eventBytes: 12 };
const BUFFER = { values: 5, times: 6, rows: 7, crossings: 8, events: 9, message: 10 };
const COUNT = { rows: 7, crossings: 8, events: 9, steps: 13 };
const DONE = 0, MORE = 1;
const SLICE = 256; // steps of one call: a millisecond or two, so that a budget of time is kept

export class Engine {
  constructor(module) {
    const instance = new WebAssembly.Instance(module, {});
    this.c = instance.exports;
    this.n = {};
    for (const name in SIZE) this.n[name] = this.c.explore_size(SIZE[name]);
    this.at = {};
    for (const name in BUFFER) this.at[name] = this.c.explore_buffer(BUFFER[name]);
  }

  numbers(name, length) {
    return new Float64Array(this.c.memory.buffer, this.at[name], length);
  }

  // why the engine refused last; names of C functions in front are of no use to the reader
  get message() {
    const bytes = new Uint8Array(this.c.memory.buffer, this.at.message, 512);
    const end = bytes.indexOf(0);
    const text = new TextDecoder().decode(bytes.slice(0, end < 0 ? 512 : end));
    return text.replace(/^(stickslip|whole_run|explore)_\w+: /, "");
  }

  // from values in the order of the engine: parameters, inputs, their rates, states, memories; null, or why not
  start(values, tolerance = 1e-14) {
    this.numbers("values", this.n.values).set(values);
    this.refused = this.c.explore_start(tolerance) === DONE ? null : this.message;
    return this.refused;
  }

  get period() {
    return this.c.explore_period();
  }

  // what to record from here on: rows at ascending times, and crossings of a section {state, level, direction}
  ask(times, section = null) {
    const n = Math.min(times.length, this.n.rows);
    this.numbers("times", this.n.rows).set(times.subarray ? times.subarray(0, n) : times.slice(0, n));
    this.c.explore_ask(n, section ? section.state : -1, section?.level ?? 0, section?.direction ?? 0);
    this.asked = n;
    this.events = [];
    this.crossings = [];
    this.steps = 0;
    this.status = this.refused ? 2 : MORE;
  }

  // go on until it is done or out(this) says that time is up; true once nothing more comes
  go(out = () => false) {
    while (this.status === MORE) {
      this.status = this.c.explore_continue(SLICE);
      this.#collect();
      if (this.status === MORE && out(this)) return false;
    }
    if (this.status !== DONE && !this.refused) this.refused = this.message;
    return true;
  }

  #collect() {
    const { columns, eventBytes } = this.n;
    const events = this.c.explore_count(COUNT.events), crossings = this.c.explore_count(COUNT.crossings);
    this.steps = this.c.explore_count(COUNT.steps);
    const view = new DataView(this.c.memory.buffer, this.at.events, events * eventBytes);
    for (let i = 0; i < events; i++) {
      const at = i * eventBytes;
      this.events.push({
        time: view.getFloat64(at, true), contact: view.getInt32(at + 8, true), before: view.getInt32(at + 12, true),
        after: view.getInt32(at + 16, true), work: view.getFloat64(at + 24, true),
      });
    }
    const found = this.numbers("crossings", crossings * columns);
    for (let i = 0; i < crossings; i++) this.crossings.push(found.slice(i * columns, (i + 1) * columns));
  }

  // rows done so far: a copy, one after the other, of time, states, memories, outputs and states of contacts
  get rows() {
    return this.numbers("rows", this.c.explore_count(COUNT.rows) * this.n.columns).slice();
  }
}
