"""Quantities of a motion over a period: its largest displacement, the mean of a force, the speed of its impacts.

    max(y), min(y), amplitude(y)    of a state or output; the amplitude is half of max - min
    mean(y), rms(y)                 over the period
    energy(P)                       J, integral of a power, as of "power_dissipated"
    energy(F,x)                     J, work of an output through the rate of a state
    energy(contact)                 J, what the impacts of a rigid contact take
    impact_speed(contact)           the largest at which it closes; 0 where it never does

Between events a motion is analytic. On panels so short that its last coefficients are rounding, each variable is the
polynomial through Gauss's nodes: integrals are Gauss's, extremes are roots of the polynomial's derivative, or lie at an
event, just before it or after it. Nothing is sampled for them, and nothing narrower than a panel is missed, for it
would have coefficients.

Derivatives along a direction follow from the variational equation: where an extreme lies does not matter to first
order; an integral changes by its integrand, and by what jumps at each event times how much that moves. What impacts
take has none that way: on a branch it is the difference of neighbours along the tangent.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial import legendre

from fmu_models.base.arrays import Vector
from fmu_models.base.errors import StickslipError, nearest
from fmu_models.simulation.sensitivity import SensitiveRun

if TYPE_CHECKING:
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.sections.system import SectionSystem
    from fmu_models.simulation.sensitivity import Sensitivity
    from fmu_models.simulation.trajectory import Event

NODES = 16  # of Gauss's rule on a panel
ROUNDING = 1e-13  # of the size of a variable: the last coefficients of a panel that is short enough
NOISE = 1e-8  # of it: what does not fall on narrower panels and is less is what cancelled in an output
WIDEST, ROUNDS = 0.25, 12  # of the period: widest panel; how often one is cut in four
SLACK = 0.2  # of what a variable spans on a panel: by less than that it rises beyond its nodes and ends
SPEEDS = {"N": "m/s", "N m": "rad/s"}  # by the unit of a force
WRITTEN = re.compile(r"(\w+)\((.+)\)")

X, W = legendre.leggauss(NODES)
SERIES = legendre.legvander(X, NODES - 1).T * W * (np.arange(NODES) + 0.5)[:, None]  # coefficients from values
ENDS = legendre.legvander(np.array([-1.0, 1.0]), NODES - 1) @ SERIES  # values at both ends
RISE = legendre.legval(X, legendre.legder(SERIES, axis=0)).T  # values of the derivative by u from values


def _at_ends(values: Vector) -> Vector:
    """(p, 2) of what has values (p, NODES) on panels."""
    return values @ ENDS.T


@dataclass(frozen=True)
class Amount:
    """A quantity as it was written.

    Attributes:
        kind: a key of ``AMOUNTS``.
        names: what it is of.
    """

    kind: str
    names: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.kind}({','.join(self.names)})"

    @property
    def label(self) -> str:
        """It in words: "largest x"."""
        return AMOUNTS[self.kind].label.format(" through ".join(self.names))

    def unit(self, unit_of: Callable[[str], str]) -> str:
        """Its unit, from those of variables; of a contact from that of its force."""
        if AMOUNTS[self.kind].takes == ("contact",):
            return SPEEDS.get(unit_of(f"{self.names[0]}_force"), "1")
        return AMOUNTS[self.kind].unit or unit_of(self.names[0])


@dataclass(frozen=True)
class Direction:
    """Where derivatives are taken to: changes of start states and parameters by name; of begin and end, s."""

    by: Mapping[str, float]
    begin: float
    end: float


@dataclass(frozen=True, eq=False)
class _Panels:
    """Variables of one motion on its p panels, ascending.

    Attributes:
        ends: (p, 2) s.
        values, slopes: (p, NODES) by variable; their derivatives along the direction, at fixed times.
        moves: (p, 2) by how much the ends of panels move: events alone.
        length, stretch: s, of the period, and how it changes.
        events: of the motion.
        speeds: (k, 2) at which the indicator of each falls, and how that changes.
    """

    ends: Vector
    values: Mapping[str, Vector]
    slopes: Mapping[str, Vector]
    moves: Vector
    length: float
    stretch: float
    events: Sequence[Event]
    speeds: Vector

    @cached_property
    def halves(self) -> Vector:
        """(p, 1) half widths, s."""
        return 0.5 * np.diff(self.ends, axis=1)

    def extreme(self, name: str, sign: float) -> Vector:
        """(2,) the largest of sign * variable, as a value of the variable, and its derivative."""
        y, slopes = sign * self.values[name], self.slopes[name]
        at_ends = _at_ends(y)
        known = np.hstack([y, at_ends])
        best, (panel, place) = at_ends.max(), np.unravel_index(at_ends.argmax(), at_ends.shape)
        u, at_event = (-1.0, 1.0)[place], True
        for i in np.flatnonzero(known.max(axis=1) + SLACK * np.ptp(known, axis=1) > known.max()):
            series = SERIES @ y[i]
            roots = legendre.legroots(legendre.legder(series))
            real = roots.real[(np.abs(roots.imag) < 1e-7) & (np.abs(roots.real) < 1.0)]
            tops = legendre.legval(real, series)
            if tops.size and tops.max() > best:
                best, panel, u, at_event = tops.max(), i, real[tops.argmax()], False
        slope = legendre.legval(u, SERIES @ slopes[panel])
        if at_event and (move := self.moves[panel, place]):  # an extreme there goes with its event
            slope += move * sign * _at_ends(self.rate(y))[panel, place]
        return np.array([sign * best, slope])

    def integral(self, values: Vector, slopes: Vector) -> Vector:
        """(2,) of what has values (p, NODES), and its derivative."""
        moved = np.where(self.moves == 0.0, 0.0, _at_ends(values) * self.moves) @ [-1.0, 1.0]
        return np.array([(self.halves * values @ W).sum(), (self.halves * slopes @ W).sum() + moved.sum()])

    def rate(self, values: Vector) -> Vector:
        """(p, NODES) of what has values, per second."""
        return values @ RISE.T / self.halves


def _amplitude(panels: _Panels, y: str) -> Vector:
    return 0.5 * (panels.extreme(y, 1.0) - panels.extreme(y, -1.0))


def _mean(panels: _Panels, y: str) -> Vector:
    total, change = panels.integral(panels.values[y], panels.slopes[y])
    return np.array([total, change - panels.stretch * total / panels.length]) / panels.length


def _rms(panels: _Panels, y: str) -> Vector:
    values, slopes = panels.values[y], panels.slopes[y]
    total, change = panels.integral(values**2, 2.0 * values * slopes)
    root = np.sqrt(total / panels.length)
    return np.array([root, 0.5 * (change / panels.length - panels.stretch * root**2 / panels.length) / (root or 1.0)])


def _energy(panels: _Panels, of: str, through: str = "") -> Vector:
    if of not in panels.values:
        works = [event.work for event in panels.events if event.contact == of]
        return np.array([-sum(works), np.nan])  # the engine does not differentiate works
    y, slopes = panels.values[of], panels.slopes[of]
    if not through:
        return panels.integral(y, slopes)
    rate, rate_slopes = panels.rate(panels.values[through]), panels.rate(panels.slopes[through])
    return panels.integral(y * rate, slopes * rate + y * rate_slopes)


def _impact_speed(panels: _Panels, contact: str) -> Vector:
    struck = [i for i, event in enumerate(panels.events) if event.contact == contact and event.clock == "impact"]
    return max((panels.speeds[i] for i in struck), key=lambda speed: speed[0], default=np.zeros(2))


@dataclass(frozen=True)
class _Kind:
    """A kind of quantity: what it is called, from the panels of a motion to (value, derivative), what it is of, and its
    unit, where that is not the one of the variable."""

    label: str
    of: Callable[..., Vector]
    takes: tuple[str, ...] = ("variable",)
    unit: str = ""


AMOUNTS: dict[str, _Kind] = {
    "max": _Kind("largest {}", lambda panels, y: panels.extreme(y, 1.0)),
    "min": _Kind("smallest {}", lambda panels, y: panels.extreme(y, -1.0)),
    "amplitude": _Kind("amplitude of {}", _amplitude),
    "mean": _Kind("mean {}", _mean),
    "rms": _Kind("root mean square of {}", _rms),
    "energy": _Kind("energy of {} in a period", _energy, ("variable or rigid contact", "state"), "J"),
    "impact_speed": _Kind("largest impact speed of {}", _impact_speed, ("contact",)),
}
KINDS_TOLD = ", ".join(f"{name}({','.join(kind.takes)})" for name, kind in AMOUNTS.items())


def shown_of(of: str, system: SectionSystem, others: Sequence[str] = ()) -> Amount | None:
    """What a picture is to show of motions: the quantity, None if it is a state, or one of some other words.

    Raises:
        StickslipError: it is nothing of all that.
    """
    if of in (*system.states, *others):
        return None
    fmu: Fmu | None = getattr(system, "fmu", None)
    if "(" not in of or fmu is None or not fmu.ours:
        more = f" {' and '.join(f'{chr(39)}{other}{chr(39)}' for other in others)} are drawn, too." if others else ""
        quantities = f" So are quantities of a period: {KINDS_TOLD}." if fmu and fmu.ours else ""
        raise StickslipError(f"'{system.name}' has no state '{of}'.{nearest(of, system.states)}{more}{quantities}")
    return read_amount(of, fmu)


def read_amount(text: str, fmu: Fmu) -> Amount:
    """A quantity as people write it: "max(x)".

    Raises:
        StickslipError: it is none, or not of what it is to be of.
    """
    written = WRITTEN.fullmatch(text.replace(" ", ""))
    kind = AMOUNTS.get(written[1]) if written else None
    if written is None or kind is None:
        raise StickslipError(
            f"'{text}' is no quantity of a period.{nearest(text.partition('(')[0], AMOUNTS)} There are {KINDS_TOLD}."
        )
    names = tuple(re.split(r",(?![^\[]*\])", written[2]))
    variables = [*fmu.states, *fmu.outputs]
    known = {
        "variable": variables, "state": fmu.states, "contact": fmu.contacts,
        "variable or rigid contact": [*variables, *fmu.impacts],
    }  # fmt: skip
    if len(names) > len(kind.takes) or (len(names) == 2 and names[0] not in variables):
        raise StickslipError(f"'{text}' is not understood: {written[1]}({','.join(kind.takes)}).")
    for name, what in zip(names, kind.takes, strict=False):
        if name not in known[what]:
            guess = nearest(name, known[what]) if known[what] else " It has none."
            raise StickslipError(f"'{text}': '{fmu.description.modelName}' has no {what} '{name}'.{guess}")
    return Amount(written[1], names)


class Measured:
    """One quantity of any number of motions of an FMU, by one instance of it; or the extremes of all its states.

    Args:
        amount: the quantity; None for ``extremes``.
        by: names that a ``Direction`` may have; the states if left out.
        tolerance: relative local error of a step.

    Attributes:
        by_works: it is work of impacts, which has no derivative here.
    """

    def __init__(
        self, fmu: Fmu, amount: Amount | None = None, by: Sequence[str] = (), tolerance: float = 1e-14
    ) -> None:
        self.amount, variables = amount, {*fmu.states, *fmu.outputs}
        of = amount.names if amount else tuple(fmu.states)
        self.by_works = amount is not None and amount.kind == "energy" and of[0] not in variables
        self._speeds = amount is not None and AMOUNTS[amount.kind].takes == ("contact",)
        self._names = [name for name in of if name in variables] or fmu.states[:1]
        self._run = SensitiveRun(fmu, by=by or fmu.states, recorded=self._names, passage=True, tolerance=tolerance)

    def of(self, span: tuple[float, float], run: Mapping[str, Any], along: Direction | None = None) -> Vector:
        """(2,) the quantity over a span, s, and its derivative along a direction; nan without one, and where a motion
        has none, since it touches what it does not cross.

        run: parameters, inputs, start and start_time as of ``simulate``; it begins with the span if it does not say.

        Raises:
            StickslipError: the motion cannot be continued.
        """
        assert self.amount is not None
        value, slope = AMOUNTS[self.amount.kind].of(self._panels(span, run, along), *self.amount.names)
        return np.array([value, np.nan if along is None else slope])

    def extremes(self, span: tuple[float, float], run: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
        """The smallest and the largest value of every state over a span, s; arguments and errors as of ``of``."""
        panels = self._panels(span, run, None)
        return {n: (float(panels.extreme(n, -1.0)[0]), float(panels.extreme(n, 1.0)[0])) for n in self._names}

    def _panels(self, span: tuple[float, float], run: Mapping[str, Any], along: Direction | None) -> _Panels:
        begin, end = span
        start, settings = run.get("start_time", begin), (run.get("parameters"), run.get("start"))

        def window(times: Vector) -> Any:
            return self._run.window(times, start_time=start, inputs=run.get("inputs"))

        _, events = self._run.values(window(np.array([end])), *settings)
        inner = sorted({event.time for event in events if begin < event.time < end})
        ends, values = _resolved(
            _cut(np.array([begin, *inner, end]), (end - begin) * WIDEST),
            lambda times: self._run.values(window(np.append(times, end)), *settings)[0][:-1],
        )
        slopes, moves, speeds = np.full_like(values, np.nan), np.zeros_like(ends), np.full((len(events), 2), np.nan)
        sensed = None
        if along is not None or self._speeds:
            with suppress(StickslipError):  # the motion has no derivative
                sensed = self._run.over(window(np.concatenate([[begin], _nodes(ends), [end]])), *settings)
        if sensed is not None and sensed.passage is not None:
            passage, events = sensed.passage, sensed.events
            direction = _turned(passage.rates[0], self._run.by, self._run.fmu.states, along or Direction({}, 0.0, 0.0))
            slopes = (sensed.derivative[1:-1] @ direction).reshape(values.shape)
            moves = _moves(ends, sensed, direction, (begin, end), along)
            speeds = np.stack([passage.speeds, passage.speed_derivatives @ direction], axis=1)
        stretch = along.end - along.begin if along else 0.0
        columns, rates = ({name: a[..., i] for i, name in enumerate(self._names)} for a in (values, slopes))
        return _Panels(ends, columns, rates, moves, end - begin, stretch, events, speeds)


def _cut(edges: Vector, widest: float) -> Vector:
    """(p, 2) panels between edges, none wider."""
    pieces = [
        np.linspace(first, last, max(1, int(np.ceil((last - first) / widest * (1.0 - 1e-9)))) + 1)
        for first, last in pairwise(edges)
        if last - first > NODES**2 * np.spacing(abs(last))
    ]
    return np.concatenate([np.stack([ticks[:-1], ticks[1:]], axis=1) for ticks in pieces])


def _nodes(ends: Vector) -> Vector:
    return (ends.mean(axis=1, keepdims=True) + 0.5 * np.diff(ends, axis=1) * X).ravel()


def _resolved(ends: Vector, run: Callable[[Vector], Vector]) -> tuple[Vector, Vector]:
    """Panels cut until variables are polynomials on them, and their values (p, NODES, n). Those that are none on the
    narrowest, as at a jump of a force that is no event, are left out."""
    before, left = np.full(len(ends), np.inf), ROUNDS
    while True:
        left -= 1
        values = run(_nodes(ends)).reshape(len(ends), NODES, -1)
        last = np.abs(np.einsum("kj,pjn->pkn", SERIES[-2:], values)).max(axis=1)
        sizes = np.abs(values).max(axis=(0, 1))
        rest = np.divide(last, sizes, out=np.zeros_like(last), where=sizes > 0.0).max(axis=1)
        rough = (rest > ROUNDING) & ((rest < 0.5 * before) | (rest > NOISE))
        if not rough.any() or not left:
            return ends[~rough], values[~rough]
        cut = [_cut(piece, np.diff(piece)[0] / 4.0) for piece in ends[rough]]
        ends = np.concatenate([ends[~rough], *cut])
        before = np.concatenate([rest[~rough], np.repeat(rest[rough], [len(pieces) for pieces in cut])])
        order = np.argsort(ends[:, 0])
        ends, before = ends[order], before[order]


def _turned(rates: Vector, by: Sequence[str], states: Sequence[str], along: Direction) -> Vector:
    """(m,) the direction, where a begin that comes later is a start that lies further back."""
    direction = np.array([along.by.get(name, 0.0) for name in by])
    for name, rate in zip(states, rates, strict=True):
        if name in by:
            direction[list(by).index(name)] -= rate * along.begin
    return direction


def _moves(
    ends: Vector, sensed: Sensitivity, direction: Vector, span: tuple[float, float], along: Direction | None
) -> Vector:
    """(p, 2) how the ends of panels move: with an event, or with the period."""
    times, rates = sensed.events.rows["time"], sensed.event_derivative @ direction
    moves = np.zeros_like(ends)
    for time, rate in zip(times.tolist(), rates.tolist(), strict=True):
        moves[np.abs(ends - time) <= 1e-12 * (span[1] - span[0] + abs(time))] = rate
    if along is not None:
        moves[0, 0], moves[-1, 1] = along.begin, along.end
    return moves
