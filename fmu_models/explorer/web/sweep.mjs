import { Engine } from "./engine.mjs";
// Many motions: where each stays at the section, over a parameter. The functions here run in workers too, to which they
// go as text, together with those of the engine that they use.

const BUDGET = 60000; // steps of the engine for one value

// points [x of the states] of one value of a job, and where the motion ended: {points, end, refused}
export function settle(engine, job, values, transient) {
  const { columns, states, memories, keep } = job;
  if (engine.start(values) !== null) return { points: [], end: null, refused: engine.refused };
  const period = job.section ? 0 : engine.period;
  if (!job.section && !(period > 0)) return { points: [], end: null, refused: "nothing forces the motion" };
  const last = transient + keep;
  const late = (it) => it.steps > BUDGET || (job.section && it.crossings.length >= last);
  const times = job.section ? [1e9] : Float64Array.from({ length: keep }, (_, i) => (transient + 1 + i) * period);
  engine.ask(times, job.section);
  engine.go(late);
  const rows = [];
  if (job.section) rows.push(...engine.crossings.slice(-Math.min(keep, Math.max(0, engine.crossings.length - transient))));
  else for (let all = engine.rows, i = 0; i < all.length; i += columns) rows.push(all.slice(i, i + columns));
  const end = rows.length ? rows[rows.length - 1].slice(1, 1 + states + memories) : null;
  const short = rows.length < keep && !engine.refused ? `not settled after ${BUDGET} steps` : null;
  return { points: rows.map((row) => row.slice(1, 1 + states)), end, refused: engine.refused ?? short };
}

// the values of a job between first and last, each from where the one before ended
export function* sweep(engine, job, first, last) {
  let from = null;
  for (let i = first; i < last; i++) {
    const values = Float64Array.from(job.base);
    values[job.over] = job.values[i];
    const start = Float64Array.from(values);
    if (from) start.set(from, job.firstState);
    let made = settle(engine, job, start, from ? job.transient : 2 * job.transient);
    if (from && !made.points.length) made = settle(engine, job, values, 2 * job.transient);
    from = made.end;
    yield { index: i, points: made.points, refused: made.refused };
  }
}

// what a worker does: the job, then messages with what was found, some values at a time
export function work(message, post) {
  const { module, job, first, last } = message;
  let found = [];
  for (const one of sweep(new Engine(module), job, first, last)) {
    found.push(one);
    if (found.length >= 8) {
      post({ found });
      found = [];
    }
  }
  post({ found, done: true });
}

// deals a job out to workers; tells of what is found as it comes. stop() ends it.
export function deal(module, job, count, tell) {
  const n = job.values.length, workers = [];
  const text = [Engine, settle, sweep, work].map(String).join("\n");
  const shim = `const SIZE=${JSON.stringify(SIZE)},BUFFER=${JSON.stringify(BUFFER)},COUNT=${JSON.stringify(COUNT)},DONE=0,MORE=1,SLICE=${SLICE},BUDGET=${BUDGET};`;
  const url = URL.createObjectURL(new Blob([`${shim}\n${text}\nonmessage = (e) => work(e.data, postMessage);`], { type: "text/javascript" }));
  const stop = () => {
    for (const worker of workers.splice(0)) worker.terminate();
    URL.revokeObjectURL(url);
  };
  let left = count;
  for (let w = 0; w < count; w++) {
    const worker = new Worker(url);
    workers.push(worker);
    worker.onerror = (event) => tell({ found: [], failed: event.message || "a worker could not be started", done: true });
    worker.onmessage = ({ data }) => {
      if (data.done && --left === 0) stop();
      tell({ found: data.found, done: left === 0 });
    };
    worker.postMessage({ module, job, first: Math.floor((w * n) / count), last: Math.floor(((w + 1) * n) / count) });
  }
  return stop;
}
