"""A run from event to event: DOP853 or Radau in a mode, roots of its indicators, then the states that fit from there.

an indicator is positive inside its state; the run watches it once it has been positive (a release begins at zero)
at a root:  stops and regions change; rigid contacts at their wall have an impact; then, of all contacts at zero slip or
            at their wall, the states that fit by enumeration (selection.py)
a tie:      each state that fits is followed for a short time; that which stays inside its bounds is it
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from oracle.declaration import Values
from oracle.equations import ELASTIC, FRICTION, NORMAL, SLIDER, STOP, SWITCH, TANGENT, Equations, Numbers
from oracle.selection import AWAY, HELD, RELEASED, TOUCHING, Mode, UndeterminedError, fitting, forces, impact
from scipy import optimize
from scipy.integrate import DOP853, Radau

SAMPLES = 6  # of every indicator in a step
GRAZES = "touches a bound within rounding"
AT_ZERO = 1e-9  # of a speed or place, of the sizes of the motion
APART = 1e-9  # of the terms of a rate of slip, which no forces of the held contacts bring to zero
CHATTER = 1e-7  # of the fastest impact: slower ones are the last; with friction what they do is of its order
SHORT = (1e-4, 1e-3, 1e-2)  # s, for which a tie is followed
MOST_EVENTS, MOST_EVALUATIONS = 400, 30_000


@dataclass
class Run:
    """States at the output times up to ``until``, where the laws stop to decide (``reason``), and all events."""

    times: Any
    states: Any  # (n_times, n_states); nan behind ``until``
    until: float
    reason: str = ""
    events: list[tuple[float, int, Mode]] = field(default_factory=list)


def run(equations: Equations, values: Values, times: Any, *, rtol: float = 1e-11, stiff: bool = False) -> Run:
    """The motion at ascending ``times``."""
    return _Motion(equations.at(values), np.asarray(times, float), rtol, stiff).run()


def _root(value: Callable[[float], float], low: float, high: float) -> float:
    found: Any = optimize.brentq(value, low, high, xtol=1e-14, rtol=8.9e-16)  # pyright: ignore[reportArgumentType]
    return float(found)


class _Motion:
    def __init__(self, numbers: Numbers, times: Any, rtol: float, stiff: bool) -> None:
        self.numbers, self.rows = numbers, numbers.of.rows
        self.rtol, self.stiff, self.evaluations = rtol, stiff, 0
        self.t, self.state = 0.0, numbers.start()
        self.mode: Mode = ()
        self.entries: dict[int, float] = {}
        self.fastest: dict[int, float] = {}
        self.speed = self.place = 1e-6
        self.out = Run(times, np.full((len(times), numbers.of.n_states), np.nan), 0.0)
        self.end = numbers.values.end
        known = numbers.values.parameters
        self.narrow = {
            r: float(row.law.width.subs({symbol: known[str(symbol)] for symbol in row.law.width.free_symbols}))
            for r, row in enumerate(self.rows)
            if row.law and row.law.width is not None
        }

    # what the integrator and the watch ask

    def _rates(self, mode: Mode) -> Any:
        def rates(t: float, state: Any) -> Any:
            self.evaluations += 1
            if self.evaluations > MOST_EVALUATIONS:
                raise UndeterminedError("too many evaluations for the reference")
            n, q = self.numbers.of.n, len(self.numbers.of.declared.states)
            x = self.numbers.terms(t, state)
            f = forces(self.numbers, mode, t, state, self.entries, x)
            if f.residual > APART:
                raise UndeterminedError("contacts held together part from less than rounding")
            internal = self._internal(mode, t, state, x)
            if self.numbers.of.body:
                return np.concatenate([state[q : q + n], f.rates, internal])
            return f.rates

        return rates

    def _internal(self, mode: Mode, t: float, state: Any, x: Any) -> Any:
        if not self.numbers.of.owners:
            return []
        yields = {r: self.rows[r].kind == SLIDER and mode[r] != ELASTIC for r in self.numbers.of.owners}
        speeds = {r: 0.0 if mode[r] == HELD or yields[r] else float(x.y[r]) for r in yields}
        return self.numbers.internal(t, state, speeds, {r: float(mode[r]) for r in speeds})

    def indicators(self, mode: Mode, t: float, state: Any) -> dict[tuple[int, str], float]:
        """All of a mode, positive inside."""
        x = self.numbers.terms(t, state)
        f = forces(self.numbers, mode, t, state, self.entries, x)
        values: dict[tuple[int, str], float] = {}
        for r, row in enumerate(self.rows):
            m = mode[r]
            if row.kind == FRICTION and row.gap:
                values[r, "where"] = -x.place[r] if m == AWAY else x.place[r]
            if row.kind in (FRICTION, SWITCH, TANGENT) and m != AWAY:
                values[r, "slip"] = f.margin[r] if m == HELD else m * x.y[r]
            elif row.kind == SLIDER and m == ELASTIC:
                z, bound = state[self._internal_index(r)], self._bound(r, t, state)
                values |= {(r, "upper"): bound - z, (r, "lower"): bound + z}
            elif row.kind == SLIDER:
                values[r, "turns"] = m * x.y[r]
            elif row.kind == NORMAL:
                values[r, "gap"] = x.place[r] if m == AWAY else f.margin[r]
            elif row.kind == STOP:
                values[r, "gap"] = x.place[r] if m == AWAY else -x.place[r]
                if m != AWAY and row.release == "force":
                    push = self.numbers.of_row(r, t, state, x.y[r], 0, x.place[r], self.entries.get(r, 1.0))[5]
                    values[r, "force"] = push if m == TOUCHING else -push
        return values

    # the run

    def run(self) -> Run:
        knots = [k for k in self.numbers.knots() if 0 < k < self.end]
        bounds = {self.end, *knots}
        for centre, width in self.numbers.values.features:
            bounds |= {b for b in (centre - 9 * width, centre + 9 * width) if 0 < b < self.end}
        try:
            with np.errstate(over="raise", invalid="raise"):
                self._begin()
                for bound in sorted(bounds):
                    self.numbers.side = (self.t + bound) / 2
                    if self.t in knots:
                        self._select({}, first=False)
                    self._to(bound)
        except UndeterminedError as stop:
            self.out.reason = str(stop)
        except ArithmeticError as far:
            self.out.reason = f"the motion leaves the range of numbers: {far}"
        self.out.until = self.t
        at = self.out.times <= self.t
        self.out.states[~at] = np.nan
        return self.out

    def _flight(self) -> float:
        """Half the time after which what has just bounced is back."""
        x = self.numbers.terms(self.t, self.state)
        f = forces(self.numbers, self.mode, self.t, self.state, self.entries, x)
        flights = [
            x.y[r] / -f.slip_rate[r]
            for r, row in enumerate(self.rows)
            if row.kind == NORMAL and self.mode[r] == AWAY and x.y[r] > 0.0 > f.slip_rate[r]
        ]
        return float(min(flights, default=np.inf))

    def _longest(self) -> float:
        """A step that no pulse and nothing a law does around rest falls through."""
        middle = self.numbers.side
        widths = [w / 3 for c, w in self.numbers.values.features if abs(middle - c) <= 9 * w]
        slips = [r for r in self.narrow if self.mode[r] in (1, -1)]
        if slips:
            x = self.numbers.terms(self.t, self.state)
            rates = forces(self.numbers, self.mode, self.t, self.state, self.entries, x).slip_rate
            for r in slips:
                speed, width = abs(float(x.y[r])), self.narrow[r]
                widths.append(max(speed - 9 * width, width / 3) / max(abs(float(rates[r])), 1e-6))
        return min([0.1, *widths])

    def _to(self, bound: float) -> None:
        stuck = 0
        while self.t < bound:
            before = self.t
            fallen = self._step(bound)
            if fallen:
                stuck = stuck + 1 if self.t - before < 1e-12 else 0
                if stuck > 20 or len(self.out.events) > MOST_EVENTS:
                    raise UndeterminedError("events accumulate")
                self._select(fallen)

    def _step(self, bound: float) -> dict[tuple[int, str], float]:
        """Integrate to the bound or to the first event; the indicators that fall there."""
        mode = self.mode
        method: Any = Radau if self.stiff else DOP853
        atol = self.rtol * 1e-2 * max(min(self.place, self.speed), 1e-6)
        first = min(self._flight(), bound - self.t)
        solver = method(
            self._rates(mode),
            *(self.t, self.state.copy(), bound),
            **{"rtol": self.rtol, "atol": atol, "max_step": self._longest()},
            **({"first_step": first} if first < self._longest() else {}),
        )
        armed = {key: value > 0 for key, value in self.indicators(mode, self.t, self.state).items()}
        last = self.indicators(mode, self.t, self.state)
        # what begins at zero may be rounding below it
        armed = {key: armed[key] and last[key] > AT_ZERO * self._size(key) for key in armed}
        while solver.status == "running":
            solver.step()
            if solver.status == "failed":
                raise UndeterminedError("the reference cannot go on")
            dense, t0, t1 = solver.dense_output(), float(solver.t_old), float(solver.t)
            points = t0 + (t1 - t0) * np.linspace(0, 1, SAMPLES + 1)[1:]
            hits: dict[tuple[int, str], float] = {}
            rows = [(t0, last)]
            for t in points:
                rows.append((float(t), self.indicators(mode, t, dense(t))))
            for key in last:
                hit = self._fall(key, rows, dense, mode, armed)
                if hit is not None:
                    hits[key] = hit
            stop = min(hits.values(), default=t1)
            self._record(t0, stop, dense)
            self.speed = max(self.speed, float(np.abs(solver.y).max()))
            self.place = self.speed
            if hits:
                self.t, self.state = stop, dense(stop)
                return {key: t for key, t in hits.items() if t <= stop + 1e-11 * max(1.0, stop)}
            last = rows[-1][1]
            self.t, self.state = t1, solver.y.copy()
            solver.max_step = self._longest()
        return {}

    def _size(self, key: tuple[int, str]) -> float:
        return self.speed if key[1] != "force" else 1.0

    def _fall(self, key: Any, rows: Any, dense: Any, mode: Mode, armed: dict[Any, bool]) -> float | None:
        """Where an indicator falls to zero within samples, or dips below it between them."""

        def value(t: float) -> float:
            return self.indicators(mode, t, dense(t))[key]

        for i, (t, values) in enumerate(rows):
            now = values[key]
            if not armed[key]:
                if now > 0:
                    armed[key] = now > 1e-13 * self._size(key) or i > 0
                elif now < -AT_ZERO * self._size(key) and i > 0:
                    return rows[0][0]  # not the state that it should be in
                continue
            if i and now <= 0:
                before = rows[i - 1][0]
                if value(before) <= 0:
                    return before
                return _root(value, before, t) if now < 0 else t
            if i >= 2 and armed[key]:
                a, b, c = (rows[i - k][1][key] for k in (2, 1, 0))
                if 0 < b < a and b < c and b < 0.5 * max(a - b, c - b):
                    low: Any = optimize.minimize_scalar(
                        value, bounds=(rows[i - 2][0], t), method="bounded", options={"xatol": 1e-13}
                    )
                    if abs(low.fun) <= 10 * AT_ZERO * self._size(key):
                        raise UndeterminedError(GRAZES)
                    if low.fun < 0 < value(rows[i - 2][0]):
                        return _root(value, rows[i - 2][0], low.x)
        return None

    def _record(self, t0: float, t1: float, dense: Any) -> None:
        inside = np.flatnonzero((self.out.times >= t0) & (self.out.times <= t1))
        for k in inside:
            self.out.states[k] = dense(self.out.times[k])[: self.numbers.of.n_states]

    # events

    def _begin(self) -> None:
        self.numbers.side = min([1e-9, *self.numbers.knots()[1:2]])
        x = self.numbers.terms(0.0, self.state)
        self.speed = self.place = max(float(np.abs(self.state).max()), 1e-3)
        mode = []
        for r, row in enumerate(self.rows):
            if row.kind == FRICTION and row.gap and x.place[r] < 0:
                mode.append(AWAY)
            elif row.kind == STOP:
                inside = x.place[r] < 0 or (x.place[r] == 0 and x.y[r] < 0)
                if inside:
                    self.entries[r] = -float(x.y[r])
                push = self.numbers.of_row(r, 0.0, self.state, x.y[r], 0, x.place[r], self.entries.get(r, 1.0))[5]
                mode.append(AWAY if not inside else TOUCHING if row.release == "gap" or push > 0 else RELEASED)
            elif row.kind in (NORMAL, TANGENT, SLIDER):
                mode.append(AWAY)
            else:
                mode.append(1 if x.y[r] >= 0 else -1)
        self.mode = tuple(mode)
        self._record(0.0, 0.0, lambda _: self.state)
        self._select({}, first=True)

    def _select(self, fallen: Mapping[tuple[int, str], float], first: bool = False) -> None:
        mode, before = list(self.mode), self.state.copy()
        x = self.numbers.terms(self.t, self.state)
        for r, what in fallen:
            self._changed(mode, r, what, x)
        x = self.numbers.terms(self.t, self.state)
        self._strike(mode, fallen, x)
        x = self.numbers.terms(self.t, self.state)
        smooth = np.array_equal(before, self.state)  # what was held may slip after a jump
        for r, row in enumerate(self.rows):
            if row.kind == SLIDER and mode[r] != ELASTIC and mode[r] * x.y[r] < 0:
                mode[r] = ELASTIC
        options: dict[int, tuple[int, ...]] = {}
        zero = AT_ZERO * self.speed
        for r, row in enumerate(self.rows):
            if row.kind in (FRICTION, SWITCH) and mode[r] != AWAY:
                falls = any(key[0] == r for key in fallen)
                held = smooth and mode[r] == HELD
                if held or falls or abs(x.y[r]) <= zero:
                    sticks = row.kind == SWITCH or (row.law is not None and row.law.sticks)
                    at_zero = held or abs(x.y[r]) <= 10 * zero
                    options[r] = ((HELD, 1, -1) if sticks else (1, -1)) if at_zero else (1 if x.y[r] > 0 else -1,)
                else:
                    mode[r] = 1 if x.y[r] > 0 else -1
            elif row.kind == NORMAL and mode[r] == HELD:
                options[r] = (HELD, AWAY)
                if row.partner >= 0:
                    slides = abs(x.y[row.partner]) > zero
                    sign = 1 if x.y[row.partner] > 0 else -1
                    options[row.partner] = (sign, AWAY) if slides else (HELD, 1, -1, AWAY)
        earlier = self.mode
        self.mode = self._chosen(tuple(mode), options)
        for r, row in enumerate(self.rows):
            if row.law is not None and row.law.renewed and (earlier[r] == HELD) != (self.mode[r] == HELD):
                self.state[self._internal_index(r)] = 0.0
        if not first:
            self.out.events.append((self.t, min((r for r, _ in fallen), default=-1), self.mode))
        self._project()

    def _internal_index(self, r: int) -> int:
        return self.numbers.of.n_states + self.numbers.of.owners.index(r)

    def _bound(self, r: int, t: float, state: Any) -> float:
        """Of a slider."""
        return float(self.numbers.of_row(r, t, state, 0.0, 0.0)[1])

    def _changed(self, mode: list[int], r: int, what: str, x: Any) -> None:
        """A stop, a region or a switch with a jump."""
        row = self.rows[r]
        if row.kind == SLIDER:
            mode[r] = {"upper": 1, "lower": -1, "turns": ELASTIC}[what]
            if what != "turns":
                self.state[self._internal_index(r)] = mode[r] * self._bound(r, self.t, self.state)
        elif what == "where":
            mode[r] = AWAY if mode[r] != AWAY else (1 if x.y[r] >= 0 else -1)
        elif row.kind == STOP and what == "gap":
            if mode[r] == AWAY:
                self.entries[r] = -float(x.y[r])
                push = self.numbers.of_row(r, self.t, self.state, x.y[r], 0, 0.0, self.entries[r])[5]
                mode[r] = TOUCHING if row.release == "gap" or push >= 0 else RELEASED
            else:
                mode[r] = AWAY
        elif row.kind == STOP:
            mode[r] = RELEASED if mode[r] == TOUCHING else TOUCHING
        elif row.kind == SWITCH and mode[r] != HELD and row.sides in ("both", "+" if mode[r] > 0 else "-"):
            self.state = self.numbers.jump(r, self.t, self.state)

    def _strike(self, mode: list[int], fallen: Any, x: Any) -> None:
        """The impact of what arrives at its wall, with all that is there."""
        zero, wall = AT_ZERO * self.speed, AT_ZERO * self.place
        normals = [r for r, row in enumerate(self.rows) if row.kind == NORMAL]
        touching = [r for r in normals if mode[r] == HELD or (r, "gap") in fallen or abs(x.place[r]) <= wall]
        if any(x.place[r] < -10 * wall for r in normals if mode[r] != HELD):
            raise UndeterminedError("a start inside a wall")
        arriving = [r for r in touching if x.y[r] < -zero]
        if arriving:
            q = len(self.numbers.of.declared.states)
            self.state[q : q + self.numbers.of.n] += impact(self.numbers, touching, self.t, self.state)
            for r in arriving:
                self.fastest[r] = max(self.fastest.get(r, 0.0), -float(x.y[r]))
        after = self.numbers.terms(self.t, self.state)
        for r in touching:
            slow = r in arriving and after.y[r] <= CHATTER * self.fastest[r]
            mode[r] = HELD if abs(after.y[r]) <= zero or slow else AWAY
            if self.rows[r].partner >= 0:
                mode[self.rows[r].partner] = mode[r]
        self.mode = tuple(
            m if row.kind not in (NORMAL, TANGENT) else mode[r]
            for r, (m, row) in enumerate(zip(self.mode, self.rows, strict=True))
        )

    def _chosen(self, mode: Mode, options: Mapping[int, tuple[int, ...]]) -> Mode:
        if not options:
            return mode
        matches = fitting(self.numbers, mode, options, self.t, self.state, self.entries)
        if len(matches) == 1:
            return matches[0][0]
        if not matches:
            raise UndeterminedError("no contact states fit the laws")
        rigid = all(self.rows[r].kind in (NORMAL, TANGENT) for r in options)
        if rigid and not any(tie for _, tie in matches):
            raise UndeterminedError("several contact states fit the laws")
        for length in SHORT:
            following = [match for match, _ in matches if self._stays(match, options, length)]
            if len(following) == 1:
                return following[0]
            if following:
                return self._same(following, length)
        raise UndeterminedError("no contact states last")

    def _same(self, modes: list[Mode], length: float) -> Mode:
        """The first of several modes, if all move alike."""
        ends = [self._followed(mode, length)(self.t + length) for mode in modes]
        if max(float(np.abs(end - ends[0]).max()) for end in ends) > 1e-12 * max(1.0, self.speed):
            raise UndeterminedError("several motions fit the laws")
        return modes[0]

    def _followed(self, mode: Mode, length: float) -> Any:
        solver = DOP853(self._rates(mode), self.t, self.state.copy(), self.t + length, rtol=1e-13, atol=1e-15)
        pieces = []
        while solver.status == "running":
            solver.step()
            pieces.append((float(solver.t), solver.dense_output()))
        return lambda t: next((dense for end, dense in pieces if t <= end), pieces[-1][1])(t)

    def _stays(self, mode: Mode, options: Mapping[int, Any], length: float) -> bool:
        """Whether what is decided stays inside its bounds for a time, rounding left out."""
        try:
            motion = self._followed(mode, length)
            for share in (0.3, 0.6, 1.0):
                t = self.t + share * length
                for key, value in self.indicators(mode, t, motion(t)).items():
                    if key[0] in options and value < -1e-14 * self._size(key):
                        return False
        except (np.linalg.LinAlgError, IndexError):
            return False
        return True

    def _project(self) -> None:
        """Velocities onto what is held from here on."""
        held = [r for r in range(len(self.rows)) if self.mode[r] == HELD and self.rows[r].kind != STOP]
        if not held:
            return
        if not self.numbers.of.body:
            return
        x = self.numbers.terms(self.t, self.state)
        J, inverse = x.J[held], np.linalg.inv(x.M)
        impulse = np.linalg.lstsq(J @ inverse @ J.T, x.y[held], rcond=1e-11)[0]
        q = len(self.numbers.of.declared.states)
        self.state[q : q + self.numbers.of.n] -= inverse @ J.T @ impulse
