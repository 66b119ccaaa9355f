// Pictures of lines, dots and shaded stretches, on a canvas or as SVG: drawn once as a list, rendered either way.

const MARGIN = { left: 62, right: 10, top: 10, bottom: 38 };

export function nice(low, high, count) {
  if (!(high > low)) return [low];
  const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].find((f) => f * power >= raw);
  const ticks = [];
  for (let t = Math.ceil(low / step) * step; t <= high + step * 1e-9; t += step) ticks.push(Math.abs(t) < step * 1e-9 ? 0 : t);
  return ticks;
}

export function brief(value, digits = 5) {
  if (!Number.isFinite(value)) return "–";
  const text = value.toPrecision(digits);
  return String(Number(text)).length <= text.length + 2 ? String(Number(text)).replace("e+", "e") : text;
}

// so many that neighbouring ticks are told apart
function digits(ticks) {
  const step = Math.abs((ticks[1] ?? 0) - ticks[0]), most = Math.max(...ticks.map(Math.abs));
  return step > 0 && most > 0 ? Math.min(12, Math.max(2, Math.ceil(Math.log10(most / step)) + 1)) : 4;
}

export class Picture {
  constructor(canvas) {
    this.canvas = canvas;
    this.resize();
  }

  resize() {
    const ratio = window.devicePixelRatio || 1, box = this.canvas.getBoundingClientRect();
    this.width = Math.max(200, Math.round(box.width));
    this.height = Math.max(120, Math.round(box.height));
    this.canvas.width = this.width * ratio;
    this.canvas.height = this.height * ratio;
    this.ratio = ratio;
  }

  // a new drawing with these axes: {x: [low, high, label], y: [...]}
  begin(axes, colours) {
    const widen = ([low, high, label]) => {
      if (!(Number.isFinite(low) && Number.isFinite(high))) return [-1, 1, label];
      const edge = high > low ? 0.04 * (high - low) : Math.abs(low) * 0.1 || 1;
      return [low - edge, high + edge, label];
    };
    this.colours = colours;
    this.x = axes.exact ? axes.x : widen(axes.x);
    this.y = widen(axes.y);
    this.list = [];
    this.plane = { left: MARGIN.left, right: this.width - MARGIN.right, top: MARGIN.top, bottom: this.height - MARGIN.bottom };
  }

  px(x) { return this.plane.left + ((x - this.x[0]) / (this.x[1] - this.x[0])) * (this.plane.right - this.plane.left); }
  py(y) { return this.plane.bottom - ((y - this.y[0]) / (this.y[1] - this.y[0])) * (this.plane.bottom - this.plane.top); }

  // what stands at a place of the canvas, in units of the axes
  at(clientX, clientY) {
    const box = this.canvas.getBoundingClientRect();
    const u = (clientX - box.left - this.plane.left) / (this.plane.right - this.plane.left);
    const v = (this.plane.bottom - clientY + box.top) / (this.plane.bottom - this.plane.top);
    return [this.x[0] + u * (this.x[1] - this.x[0]), this.y[0] + v * (this.y[1] - this.y[0])];
  }

  // points [x, y, x, y, ...] in units of the axes, in pixels
  places(points) {
    const places = new Float32Array(points.length);
    for (let i = 0; i < points.length; i++) places[i] = i % 2 ? this.py(points[i]) : this.px(points[i]);
    return places;
  }

  // a nan lifts the pen
  line(points, colour, width = 1.2) {
    this.list.push({ what: "line", places: this.places(points), colour, width });
  }

  dots(points, colour, size = 2) {
    this.list.push({ what: "dots", places: this.places(points), colour, size });
  }

  // stretches [from, to, ...] of x, over the whole height or so many pixels above the bottom
  shade(stretches, colour, lane = null) {
    const { top, bottom, left, right } = this.plane;
    for (let i = 0; i < stretches.length; i += 2) {
      const from = Math.max(left, this.px(stretches[i])), to = Math.min(right, this.px(stretches[i + 1]));
      const [y, height] = lane === null ? [top, bottom - top] : [bottom - 7 * (lane + 1), 6];
      if (to > from) this.list.push({ what: "box", x: from, y, width: Math.max(0.5, to - from), height, colour });
    }
  }

  // renderers -------------------------------------------------------------------------------------------------------

  #axes() {
    const { left, right, top, bottom } = this.plane, lines = [], texts = [];
    const across = nice(this.x[0], this.x[1], this.width < 420 ? 4 : 7), up = nice(this.y[0], this.y[1], this.height < 200 ? 3 : 6);
    for (const t of across) {
      lines.push([this.px(t), bottom, this.px(t), bottom + 4]);
      texts.push({ x: this.px(t), y: bottom + 16, text: brief(t, digits(across)), anchor: "middle" });
    }
    for (const t of up) {
      lines.push([left - 4, this.py(t), left, this.py(t)]);
      texts.push({ x: left - 6, y: this.py(t) + 4, text: brief(t, digits(up)), anchor: "end" });
    }
    texts.push({ x: (left + right) / 2, y: this.height - 6, text: this.x[2], anchor: "middle" });
    texts.push({ x: 13, y: (top + bottom) / 2, text: this.y[2], anchor: "middle", turned: true });
    return { lines, texts, frame: [left, top, right - left, bottom - top] };
  }

  draw() {
    const c = this.canvas.getContext("2d"), { left, right, top, bottom } = this.plane;
    c.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    c.fillStyle = this.colours.ground;
    c.fillRect(0, 0, this.width, this.height);
    c.save();
    c.beginPath();
    c.rect(left, top, right - left, bottom - top);
    c.clip();
    for (const one of this.list) {
      c.strokeStyle = c.fillStyle = one.colour;
      if (one.what === "box") c.fillRect(one.x, one.y, one.width, one.height);
      else if (one.what === "dots") {
        for (let i = 0; i < one.places.length; i += 2)
          c.fillRect(one.places[i] - one.size / 2, one.places[i + 1] - one.size / 2, one.size, one.size);
      } else {
        c.lineWidth = one.width;
        c.lineJoin = "round";
        c.beginPath();
        let down = false;
        for (let i = 0; i < one.places.length; i += 2) {
          const [x, y] = [one.places[i], one.places[i + 1]];
          if (Number.isNaN(x) || Number.isNaN(y)) down = false;
          else if (down) c.lineTo(x, y);
          else c.moveTo(x, y), (down = true);
        }
        c.stroke();
      }
    }
    c.restore();
    const axes = this.#axes();
    c.strokeStyle = c.fillStyle = this.colours.ink;
    c.lineWidth = 1;
    c.font = "12px system-ui, sans-serif";
    c.strokeRect(...axes.frame);
    c.beginPath();
    for (const [x, y, u, v] of axes.lines) c.moveTo(x, y), c.lineTo(u, v);
    c.stroke();
    for (const t of axes.texts) {
      c.save();
      c.translate(t.x, t.y);
      if (t.turned) c.rotate(-Math.PI / 2);
      c.textAlign = t.anchor === "end" ? "right" : "center";
      c.fillText(t.text, 0, 0);
      c.restore();
    }
  }

  svg(title) {
    const escape = (text) => String(text).replace(/[&<>"]/g, (s) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" })[s]);
    const round = (x) => x.toFixed(2), { left, top, right, bottom } = this.plane, axes = this.#axes();
    const shapes = this.list.map((one) => {
      if (one.what === "box") return `<rect x="${round(one.x)}" y="${round(one.y)}" width="${round(one.width)}" height="${round(one.height)}" fill="${one.colour}"/>`;
      let path = "", down = false;
      for (let i = 0; i < one.places.length; i += 2) {
        const [x, y] = [one.places[i], one.places[i + 1]];
        if (Number.isNaN(x) || Number.isNaN(y)) down = false;
        else if (one.what === "dots") path += `M${round(x)} ${round(y)}h0`;
        else (path += `${down ? "L" : "M"}${round(x)} ${round(y)}`), (down = true);
      }
      const pen = one.what === "dots" ? `stroke-width="${one.size}" stroke-linecap="round"` : `stroke-width="${one.width}" stroke-linejoin="round"`;
      return `<path d="${path}" fill="none" stroke="${one.colour}" ${pen}/>`;
    });
    const texts = axes.texts.map((t) => `<text x="${round(t.x)}" y="${round(t.y)}" text-anchor="${t.anchor}"${t.turned ? ` transform="rotate(-90 ${round(t.x)} ${round(t.y)})"` : ""}>${escape(t.text)}</text>`);
    const ticks = axes.lines.map(([x, y, u, v]) => `M${round(x)} ${round(y)}L${round(u)} ${round(v)}`).join("");
    return `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${this.width} ${this.height}" width="${this.width}" height="${this.height}" font-family="sans-serif" font-size="12"><title>${escape(title)}</title><rect width="100%" height="100%" fill="${this.colours.ground}"/><clipPath id="plane"><rect x="${left}" y="${top}" width="${right - left}" height="${bottom - top}"/></clipPath><g clip-path="url(#plane)">${shapes.join("")}</g><path d="${ticks}" stroke="${this.colours.ink}"/><rect x="${left}" y="${top}" width="${right - left}" height="${bottom - top}" fill="none" stroke="${this.colours.ink}"/><g fill="${this.colours.ink}">${texts.join("")}</g></svg>\n`;
  }
}
