// A measured cycle against a modelled one: the twin of identification/model_check/portraits.py, with the same levels.
import { range, same } from "./processing.mjs";

// metrics {name, value, limit, passed} of a model's motion; what is not judged is left out
export function compared(measured, model, levels) {
  const first = measured.sequence ?? [], second = model.sequence ?? [];
  const alike = first.length === second.length && (!first.length || first.some((_, k) => same(first, [...second.slice(k), ...second.slice(0, k)])));
  const found = [{ name: "same motion", value: alike ? 0 : 1, limit: 0, passed: alike }];
  if (!measured.angle || !model.angle || Boolean(first.length) !== Boolean(second.length)) return found;
  const add = (name, value) => {
    const limit = levels.limits[Object.keys(levels.limits).find((key) => name.startsWith(key))];
    found.push({ name, value, limit, passed: Math.abs(value) <= limit });
  };
  add("amplitude", model.amplitude / measured.amplitude - 1);
  add("period", model.period / measured.period - 1);
  const contacts = Object.keys(measured.sticks);
  for (const contact of contacts) {
    add(`stick fraction${contacts.length > 1 ? ` ${contact}` : ""}`, model.sticks[contact].fraction - measured.sticks[contact].fraction);
  }
  const scale = [range(measured.angle) / 2, range(measured.speed) / 2];
  const scaled = ({ angle, speed }) => ({ x: angle.map((v) => v / scale[0]), y: speed.map((v) => v / scale[1]) });
  const [a, b] = [scaled(measured), scaled(model)];
  add("area", symmetricDifference(a, b, levels.scanlines) / area(a));
  add("rms", aligned(a, b).rms);
  return found;
}

function area({ x, y }) {
  let sum = 0;
  for (let i = 0, n = x.length; i < n; i++) sum += x[i] * y[(i + n - 1) % n] - y[i] * x[(i + n - 1) % n];
  return Math.abs(sum) / 2;
}

// area inside one of two closed curves and outside the other: pairs of crossings along vertical lines enclose it
function symmetricDifference(a, b, scanlines) {
  const low = Math.min(...a.x, ...b.x), width = (Math.max(...a.x, ...b.x) - low) / scanlines;
  const heights = Array.from({ length: scanlines }, () => []);
  for (const { x, y } of [a, b]) {
    for (let i = 0, n = x.length; i < n; i++) {
      const [x0, y0, x1, y1] = [x[i], y[i], x[(i + 1) % n], y[(i + 1) % n]], left = Math.min(x0, x1), right = Math.max(x0, x1);
      for (let k = Math.max(0, Math.floor((left - low) / width - 0.5)); k < scanlines; k++) {
        const line = low + width * (k + 0.5);
        if (line >= right) break;
        if (line >= left) heights[k].push(y0 + ((line - x0) / (x1 - x0)) * (y1 - y0));
      }
    }
  }
  let sum = 0;
  for (const line of heights) {
    line.sort((p, q) => p - q);
    for (let i = 0; i + 1 < line.length; i += 2) sum += line[i + 1] - line[i];
  }
  return sum * width;
}

// root mean square distance at equal phase, and the shift of the second at which it is least
export function aligned(a, b) {
  const n = a.x.length;
  let best = { sum: Infinity, shift: 0 };
  for (let shift = 0; shift < n; shift++) {
    let sum = 0;
    for (let i = 0; i < n && sum < best.sum; i++) {
      const j = (i + n - shift) % n;
      sum += (a.x[i] - b.x[j]) ** 2 + (a.y[i] - b.y[j]) ** 2;
    }
    if (sum < best.sum) best = { sum, shift };
  }
  return { rms: Math.sqrt(best.sum / (2 * n)), shift: best.shift };
}
