// What a motion is: where it is looked at, the section it meets, its period, word, shares of stick and extremes.

export const LONGEST = 64; // period that is looked for, in steps of the section
const CLOSED = 1e-6; // of the size of a state, up to which two points of the section are one
const STICK = 0, TOUCHING = 3, CHATTERING = 5;

// whether a contact holds its bodies: it sticks, or they touch
export function holds(kind, state) {
  return kind === "stop" || kind === "impact" ? state === TOUCHING || state === CHATTERING : state === STICK;
}

// whether an event is one that a word counts: a contact or a stick begins, or rigid bodies meet
export function begins(kind, event) {
  if (kind === "impact") return !holds(kind, event.before);
  return holds(kind, event.after) && !holds(kind, event.before);
}

// columns of a row
export function columns(model) {
  const states = 1, memories = states + model.states.length, outputs = memories + model.memories.length;
  return { time: 0, states, memories, outputs, contacts: outputs + model.outputs.length, count: outputs + model.outputs.length + model.contacts.length };
}

// ascending times: in the opening of a motion, from where it is taken to be settled, and in its last turns; with the
// strobes of a period
export function sampling({ until, opening, settled, last: ending, period }, coarse, fine) {
  const times = [];
  for (let i = 0; i < fine; i++) times.push(ending + ((until - ending) * i) / fine);
  for (let i = 0; i < coarse; i++) times.push((opening * i) / coarse);
  for (let i = 0; i <= fine; i++) times.push(settled + ((until - settled) * i) / fine);
  const last = period > 0 ? Math.floor(until / period * (1 + 1e-12)) : -1;
  const strobes = new Set();
  for (let k = Math.max(0, last - 4 * LONGEST); k <= last; k++) strobes.add(k * period);
  const all = Float64Array.from(new Set([...times, ...[...strobes].filter((t) => t <= until)])).sort();
  return { times: all, strobes: [...all.keys()].filter((i) => strobes.has(all[i])) };
}

// a level that a state meets again and again: a velocity at zero where it does not rest there, or a state at its middle;
// of those the first that is met least often, which is that of the plane drawn where it is one of several
export function findSection(rows, at, from, model, preferred) {
  const n = model.states.length, nq = model.coordinates, tail = rows.slice(from), tries = [];
  if (rested(rows, from, at, model)) return null;
  for (let i = nq; i < Math.min(2 * nq, n); i++) tries.push({ state: i, level: 0, direction: -1 });
  tries.sort((a, b) => (b.state === preferred) - (a.state === preferred));
  const middles = Array.from({ length: n }, (_, i) => {
    const [low, high] = extremes(tail, at.states + i);
    return { state: i, level: rounded((low + high) / 2, high - low), direction: 1 };
  });
  for (const some of [tries.filter((one) => !rests(tail, at.states + one.state, one.level)), middles, tries]) {
    const counts = some.map((one) => met(tail, at.states + one.state, one)), enough = counts.filter((count) => count >= 3);
    if (enough.length) return some[counts.indexOf(Math.min(...enough))];
  }
  return null;
}

// whether a state stays on a level for a while
function rests(rows, column, level) {
  const [low, high] = extremes(rows, column);
  return rows.filter((row) => Math.abs(row[column] - level) < 1e-9 * (high - low)).length > 0.02 * rows.length;
}

// whether a coordinate goes on and on: its first half and its second have no value in common
export function drifts(rows, column) {
  const half = Math.floor(rows.length / 2), [a, b] = extremes(rows.slice(0, half), column), [c, d] = extremes(rows.slice(half), column);
  return half > 2 && (b - a) + (d - c) < 1.1 * (Math.max(b, d) - Math.min(a, c));
}

// a number with no more digits than a span needs
function rounded(value, span) {
  if (!(span > 0)) return value;
  const unit = 10 ** Math.floor(Math.log10(span) - 2);
  return Number((Math.round(value / unit) * unit).toPrecision(12));
}

function met(rows, column, { level, direction }) {
  let count = 0;
  for (let i = 1; i < rows.length; i++) {
    const before = rows[i - 1][column] - level, after = rows[i][column] - level;
    if (direction < 0 ? before > 0 && after <= 0 : before < 0 && after >= 0) count++;
  }
  return count;
}

export function extremes(rows, column) {
  let low = Infinity, high = -Infinity;
  for (const row of rows) {
    if (row[column] < low) low = row[column];
    if (row[column] > high) high = row[column];
  }
  return [low, high];
}

// ranges of the states over rows
export function ranges(rows, at, model) {
  return model.states.map((_, i) => extremes(rows, at.states + i)).map(([low, high]) => high - low);
}

// whether the settled part of a motion does not move, in parts of what the motion did before
export function rested(rows, from, at, model) {
  const all = ranges(rows, at, model);
  return ranges(rows.slice(from), at, model).every((range, i) => range <= CLOSED * all[i]);
}

// steps of the section after which the motion repeats itself; 0 if it does not. A coordinate may go on by equal steps.
// sizes: of the states in the motion
export function periodOf(points, at, model, sizes) {
  const n = model.states.length, m = points.length;
  if (m < 3) return 0;
  const step = (k, n0, i) => points[m - 1 - k][at.states + i] - points[m - 1 - k - n0][at.states + i];
  for (let period = 1; period <= Math.min(LONGEST, Math.floor((m - 1) / 2)); period++) {
    let same = true;
    for (let i = 0; i < n && same; i++) {
      const drift = i < model.coordinates ? step(0, period, i) : 0;
      for (let k = 0; k <= period && same; k++) same = Math.abs(step(k, period, i) - drift) <= CLOSED * sizes[i];
    }
    if (same) return period;
  }
  return 0;
}

// all of it, of a motion {rows, events, points}; over its last period where it has one, else over its settled part
export function reading(motion, at, model, from) {
  const { rows, events, points } = motion;
  const tail = rows.slice(from), rest = motion.complete && rested(rows, from, at, model);
  const period = motion.complete && !rest ? periodOf(points, at, model, ranges(tail, at, model)) : 0;
  const end = period ? points[points.length - 1][0] : rows[rows.length - 1]?.[0] ?? 0;
  const begin = period ? points[points.length - 1 - period][0] : rows[from]?.[0] ?? 0;
  const inside = events.filter((event) => event.time > begin && event.time <= end);
  const counts = model.contacts.map((c, i) => inside.filter((e) => e.contact === i && begins(c.kind, e)).length);
  const first = rows.find((row) => row[0] >= begin);
  const held = model.contacts.map((contact, i) => {
    let since = begin, state = first ? first[at.contacts + i] : NaN, sum = 0;
    for (const event of inside) {
      if (event.contact !== i) continue;
      if (holds(contact.kind, event.before)) sum += event.time - since;
      since = event.time;
      state = event.after;
    }
    if (holds(contact.kind, state)) sum += end - since;
    return end > begin ? sum / (end - begin) : 0;
  });
  return {
    rest, period, seconds: period ? end - begin : 0, word: period ? [period, ...counts].join("-") : "",
    held, extremes: model.states.map((_, i) => extremes(tail, at.states + i)),
  };
}
