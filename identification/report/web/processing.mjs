// A motion becomes a portrait: the twin of identification/model_check/processing.py, with the same levels.

// value and derivative of the local polynomials of second order through 2 half + 1 samples
export function smoothed(angle, step, half) {
  const n = angle.length, smooth = new Float64Array(n), speed = new Float64Array(n), count = 2 * half + 1;
  let m2 = 0, m4 = 0;
  for (let k = -half; k <= half; k++) (m2 += k * k), (m4 += k ** 4);
  const scale = count * m4 - m2 * m2;
  for (let middle = half; middle < n - half; middle++) {
    let s0 = 0, s1 = 0, s2 = 0;
    for (let k = -half; k <= half; k++) {
      const value = angle[middle + k];
      (s0 += value), (s1 += k * value), (s2 += k * k * value);
    }
    const a = (m4 * s0 - m2 * s2) / scale, b = s1 / m2, c = (count * s2 - m2 * s0) / scale;
    // the first and the last polynomial serve the samples at the ends, too
    const from = middle === half ? -half : 0, to = middle === n - 1 - half ? half : 0;
    for (let k = from; k <= to; k++) (smooth[middle + k] = a + k * (b + k * c)), (speed[middle + k] = (b + 2 * k * c) / step);
  }
  return { smooth, speed };
}

// a cycle {angle, speed, period, amplitude, sticks by contact} or a rest {rest, swing, words} of a motion at steady drives
export function portraitOf(angle, step, drives, levels) {
  const { smooth, speed } = smoothed(angle, step, levels.half), n = angle.length;
  const sorted = Float64Array.from(smooth).sort(), [low, high] = [0.002, 0.998].map((share) => quantile(sorted, share));
  const swing = (high - low) / 2, rest = { rest: mean(smooth), swing, words: "steady sliding" };
  const slips = Object.entries(drives).map(([contact, drive]) => [contact, speed.map((w) => Math.abs(levels.r * drive - levels.R * w))]);
  const masks = slips.map(([contact, slip]) => slip.map((v, i) => (v < levels.threshold && touches(contact, smooth[i], levels) ? 1 : 0)));
  const slides = !masks.some((mask) => mask.includes(1));
  if (swing < levels.resting) return rest;
  const middle = n >> 1, quarter = Math.floor((3 * n) / 4);
  if (slides && range(smooth.subarray(middle)) < levels.dying * range(smooth.subarray(0, middle))) {
    const late = smooth.subarray(quarter);
    return { rest: mean(late), swing: range(late) / 2, words: "a swing that dies out to steady sliding" };
  }
  const starts = risings(smooth, 0.5 * (low + high), levels.hysteresis * swing), cycles = starts.length - 1;
  if (cycles < levels.leastCycles) {
    if (slides) return rest;
    throw new Error(`The model makes ${Math.max(cycles, 0)} whole cycles in the time of this log, of which ${levels.leastCycles} or more are needed`);
  }
  const periods = starts.slice(1).map((t, i) => t - starts[i]), period = mean(periods);
  if (slides && Math.sqrt(mean(periods.map((p) => (p - period) ** 2))) > levels.irregular * period) return rest;
  const average = (values) => {
    const made = new Float64Array(levels.phases);
    for (let k = 0; k < cycles; k++) for (let j = 0; j < levels.phases; j++) made[j] += between(values, starts[k] + (j / levels.phases) * periods[k]) / cycles;
    return made;
  };
  const cycle = average(smooth), [first, last] = [starts[0], starts[cycles]].map(Math.ceil);
  const sticks = Object.fromEntries(slips.map(([contact, slip], i) => [contact, {
    fraction: mean(masks[i].subarray(first, last)), strip: average(masks[i]), real: comesToZero(slip, masks[i], step, levels),
  }]));
  const made = { angle: cycle, speed: average(speed), period: period * step, amplitude: range(cycle) / 2, sticks };
  made.sequence = sequence(sticks, levels);
  const sets = made.sequence.map((one) => one.join(" and ")).join(", ");
  made.words = sets ? `stick on ${sets}` : "a cycle without stick";
  return made;
}

function touches(contact, angle, { arrangement, changeover }) {
  if (arrangement === "together") return true;
  if (arrangement === "sequential") return contact === "disc0" ? angle < changeover : angle >= changeover;
  return contact === "disc0" ? angle <= changeover : angle >= -changeover;
}

// places, in samples, at which the values rise through a level after having been below it by a guard
function risings(values, level, guard) {
  const found = [];
  let from = -1;
  values.forEach((value, i) => {
    const height = value - level;
    if (height < -guard) from = i;
    else if (height > guard && from >= 0) {
      let [sx, sy, sxx, sxy] = [0, 0, 0, 0], count = i - from + 1;
      for (let k = 0; k < count; k++) {
        const y = values[from + k] - level;
        (sx += k), (sy += y), (sxx += k * k), (sxy += k * y);
      }
      const slope = (count * sxy - sx * sy) / (count * sxx - sx * sx);
      found.push(from - (sy - slope * sx) / count / slope);
      from = -1;
    }
  });
  return found;
}

// whether the least slip speed of most sticks is nearly none; sticks apart by less than the window are one
function comesToZero(slip, mask, step, { zero, threshold, window }) {
  const runs = [];
  for (let i = 0; i < mask.length; i++) {
    if (!mask[i]) continue;
    if (!runs.length || (i > runs.at(-1).end && (i - runs.at(-1).end) * step > window)) runs.push({ end: i, least: Infinity });
    runs.at(-1).end = i + 1;
    runs.at(-1).least = Math.min(runs.at(-1).least, slip[i]);
  }
  return runs.length > 0 && quantile(runs.map((one) => one.least).sort((a, b) => a - b), 0.5) < zero * threshold;
}

// the sets of discs that stick, one after the other within a cycle
function sequence(sticks, { phases, shortest }) {
  const names = Object.keys(sticks), runs = [];
  for (let j = 0; j < phases; j++) {
    const set = names.filter((name) => sticks[name].real && sticks[name].strip[j] > 0.5);
    if (runs.length && same(runs.at(-1).set, set)) runs.at(-1).length++;
    else runs.push({ set, length: 1 });
  }
  if (runs.length > 1 && same(runs[0].set, runs.at(-1).set)) runs.at(-1).length += runs.shift().length;
  const kept = runs.filter(({ set, length }) => set.length && length > shortest * phases).map(({ set }) => set);
  return kept.filter((set, i) => i === 0 || !same(set, kept[i - 1]));
}

export const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);
export const mean = (values) => values.reduce((sum, x) => sum + x, 0) / values.length;
export const range = (values) => values.reduce((most, x) => Math.max(most, x), -Infinity) - values.reduce((least, x) => Math.min(least, x), Infinity);

function quantile(sorted, share) {
  return between(sorted, share * (sorted.length - 1));
}

// the value at a place between samples; the last where it is beyond
function between(values, place) {
  const i = Math.min(Math.floor(place), values.length - 1), next = Math.min(i + 1, values.length - 1);
  return values[i] + (place - i) * (values[next] - values[i]);
}
