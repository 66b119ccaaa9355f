// What is drawn and told of a motion; the page that has the motion is a kind of these.
import { begins, extremes, holds, reading } from "./reading.mjs";
import { brief } from "./plot.mjs";
import { element, make, palette } from "./elements.mjs";

export const LAST = 2; // steps of the section, of a run's end that is sampled finest

export class Pictures {
  axis(q) {
    return q.unit === "1" ? q.name : `${q.name} (${q.unit})`;
  }

  draw() {
    if (!this.motion) return;
    this.read = reading(this.motion, this.at, this.model, this.motion.from);
    const colours = palette();
    this.drawPortrait(colours);
    this.drawSeries(colours);
    this.drawSection(colours);
    this.tell();
  }

  pairs(rows, i, j) {
    const made = new Float64Array(2 * rows.length);
    rows.forEach((row, k) => ((made[2 * k] = row[i]), (made[2 * k + 1] = row[j])));
    return made;
  }

  // the same as a line that is broken where bodies meet, since velocities jump there
  curve(rows, i, j) {
    const { contacts } = this.model, meetings = this.motion.events.filter((e) => contacts[e.contact].kind === "impact");
    const made = [];
    let k = 0, since = -Infinity;
    for (const row of rows) {
      while (k < meetings.length && meetings[k].time <= (since)) k++;
      if (k < meetings.length && meetings[k].time <= row[0] && made.length) made.push(NaN, NaN);
      made.push(row[i], row[j]);
      since = row[0];
    }
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
    const opening = rows.slice(0, from).filter((row) => row[0] < this.plan.opening);
    picture.line(this.curve(opening, ci, cj), colours.faint, 1);
    this.kept.forEach((one, k) => one.plane === this.state.plane && picture.line(this.pairs(one.rows, ci, cj), colours[`k${k % 4}`], 1.2));
    // a motion that repeats itself in its last turns is drawn by these, which are the finest
    const few = this.read.period > 0 && this.read.period <= LAST;
    const tail = few ? rows.filter((row) => row[0] >= this.plan.last) : rows.slice(from), held = this.pairs(tail, ci, cj);
    picture.line(this.curve(tail, ci, cj), colours.line, 1.4);
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
    const rows = [["period", read.period ? `${read.period} ${this.period > 0 ? "strobe" : "crossing"}${read.period > 1 ? "s" : ""}, ${brief(read.seconds, 9)} s` : read.rest ? "at rest" : motion.complete ? "none found" : "…"],
      ["n-p-q word", read.word || "–"],
      ...model.contacts.map((c, i) => [c.kind === "stop" || c.kind === "impact" ? `${c.name} in contact` : `${c.name} sticks`, `${brief(100 * read.held[i], 4)} %`]),
      ...model.states.map((q, i) => [q.name, `${read.extremes[i].map((x) => brief(x, 6)).join(" to ")} ${q.unit === "1" ? "" : q.unit}`])];
    list.replaceChildren(...rows.flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, value)]));
    const why = element("refusal");
    why.hidden = motion.refused === null;
    why.textContent = motion.refused ?? "";
    const [i, j] = model.planes[this.state.plane], said = read.period ? `period ${read.period}, word ${read.word}` : read.rest ? "at rest" : "no period found";
    element("portrait").setAttribute("aria-label", `Phase portrait: ${model.states[j].name} over ${model.states[i].name}; ${said}. A click starts the motion there.`);
    element("series").setAttribute("aria-label", `${this.drawable()[this.state.series].name} over time, with the states of contacts shaded`);
    element("section").setAttribute("aria-label", `${element("section-of").textContent}; ${motion.points.length} points, ${said}`);
    element("until").placeholder = String(this.until);
    if (document.activeElement !== element("until")) element("until").value = this.state.until ?? "";
  }
}
