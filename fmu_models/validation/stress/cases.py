"""The grid of stiff and extreme cases, generated from a declaration alone.

Every parameter is taken to the extremes of what it does (roles.py), one at a time; starts are put on the boundaries of
the contacts, a hair off them and on two at once; drives stop, reverse, become equal; times are long, late, and scaled
to other units. A new model is covered without writing anything.
"""

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
import sympy

from fmu_models.language.automaton import Automaton
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Parameter
from fmu_models.validation.stress.equations import StressEquations
from fmu_models.validation.stress.roles import Model, ParameterRole, roles

# values that a quantity takes by what it does; "x" values are multiples of its default
_VALUES: dict[str, tuple[float, ...]] = {
    "stiffness": (0.0, 1e1, 1e3, 1e6, 1e9, 1e12),
    "damping": (0.0, 1e-9, 1e3, 1e6, 1e9),
    "steepness": (0.0, 1.0, 1e2, 1e4, 1e6),
    "amplitude": (0.0, 1e-9, 1e-3, 1e3, 1e9),
    "frequency": (0.0, 1e-9, 1e-3, 1e3, 1e9),
    "restitution": (0.0, 0.1, 0.999, 1.0),
    "load": (0.0, 1e-9, 1e3, 1e9),
    "friction": (0.0, 1e-9, 10.0),
}
_MULTIPLES: dict[str, tuple[float, ...]] = {
    "inertia": (1e-9, 1e-3, 1e3, 1e9),
    "gap": (0.0, -1.0, 1e-9, 1e3),
    "field": (0.0, -1.0, 1e-9, 1e9),
    "rate": (0.0, 1e-6, 1e3, 1e6),
    "law": (0.0, 1e-3, 1e3),
    "drive": (0.0, -1.0, 1e-9, 1e3, 1e9),
}
# the value of a role that a quick look takes: where programs of this kind break most often
_QUICK = {
    "stiffness": 1e12, "damping": 1e9, "steepness": 1e6, "restitution": 0.999, "load": 0.0, "gap": 0.0, "drive": -1.0
}  # fmt: skip

# exponents of two of mass, length and time: as exact as no change at all; 2^30 = 1e9
UNITS = {"mass": (30, 0, 0), "length": (0, 30, 0), "time": (0, 0, 30)}
GRAZE = 1e-12
PERIODS, LONG, LATE = 10.0, 1e6, 1e6


@dataclass(frozen=True)
class Case:
    """One cell of the grid.

    Attributes:
        model: name of the oscillator.
        of: kind of contact that the case is about, or "body", "default", "start", "time", "units".
        what: what is extreme, for example "stiffness" or "start".
        name: unique in the model, for example "ks=1e+12".
        parameters, start, inputs: what differs from the defaults.
        begin, duration: s.
        scale: exponents of two of mass, length and time if the case is the default in other units.
        quick: part of the quick look.
        bounded: a long run, of which only the end is looked at.
    """

    model: str
    of: str
    what: str
    name: str
    parameters: Mapping[str, float] = field(default_factory=dict)
    start: Mapping[str, float] = field(default_factory=dict)
    inputs: Mapping[str, float] = field(default_factory=dict)
    begin: float = 0.0
    duration: float = 1.0
    scale: tuple[int, int, int] | None = None
    quick: bool = False
    bounded: bool = False


def grid(name: str, model: Model, equations: StressEquations, *, until: float | None = None) -> list[Case]:
    """All cases of a model; ``until`` replaces the ten characteristic periods that each lasts, s."""
    period = characteristic_period(model, equations)
    duration = until or PERIODS * period
    cases = [Case(name, "default", "", "default", duration=duration, quick=True)]
    seen: set[tuple[str, str]] = set()
    for role in roles(model):
        cases += _of_role(name, role, equations, duration, first=(role.does, role.of) not in seen)
        seen.add((role.does, role.of))
    cases += _coefficients(name, model, duration)
    cases += _starts(name, model, equations, duration)
    cases += _drives(name, equations, duration)
    cases.append(Case(name, "time", "late", "late start", begin=LATE * period, duration=duration))
    cases.append(Case(name, "time", "long", "1e6 periods", duration=LONG * period, bounded=True))
    if equations.has_units:
        for unit, exponents in UNITS.items():
            for sign in (1, -1):
                scale = (sign * exponents[0], sign * exponents[1], sign * exponents[2])
                label = f"{unit} x 2^{sign * 30}"
                cases.append(Case(name, "units", unit, label, duration=duration, scale=scale, quick=sign > 0))
    return cases


def _of_role(
    name: str, role: ParameterRole, equations: StressEquations, duration: float, *, first: bool
) -> Iterator[Case]:
    default = equations.parameters.get(role.name, equations.inputs.get(role.name, 0.0))
    multiples = [factor * (default or 1.0) for factor in _MULTIPLES.get(role.does, ())]
    quick = _QUICK.get(role.does)
    quick = quick * (default or 1.0) if quick is not None and role.does in _MULTIPLES else quick
    for value in dict.fromkeys((*_VALUES.get(role.does, ()), *multiples)):
        changed = {role.name: value}
        yield Case(
            name,
            role.of,
            role.does,
            f"{role.name}={value:g}",
            parameters=changed if role.name in equations.parameters else {},
            inputs=changed if role.name in equations.inputs else {},
            duration=duration,
            quick=first and value == quick,
        )


def _coefficients(name: str, model: Model, duration: float) -> Iterator[Case]:
    """Static and kinetic friction that are alike, and both nothing: one alone would contradict the other."""
    for contact in model.frictions if isinstance(model, Mechanism) else ():
        law = getattr(contact.law, "steady", contact.law)
        coefficients = [getattr(law, field, None) for field in ("mu_s", "mu_k")]
        pair = [mu for mu in coefficients if isinstance(mu, Parameter)]
        if len(pair) < 2:
            continue
        for value in (pair[0].value, 0.0):
            label = "=".join([*(mu.name for mu in pair), f"{value:g}"])
            changed = {mu.name: value for mu in pair}
            yield Case(name, "friction", "friction", label, parameters=changed, duration=duration)


def _starts(name: str, model: Model, equations: StressEquations, duration: float) -> Iterator[Case]:
    """On each boundary, a hair off it, on two at once; at rest; very fast and very slow."""
    states = equations.starts
    velocities = [s.name for s in equations.system.driven]

    def case(label: str, start: Mapping[str, float], quick: bool = False) -> Case:
        return Case(name, "start", "", label, start=dict(start), duration=duration, quick=quick)

    yield case("start at rest", dict.fromkeys(states, 0.0))
    yield case("start 1e9 fast", {v: 1e9 * (states[v] or 1.0) for v in velocities})
    yield case("start 1e-9 slow", {**dict.fromkeys(states, 0.0), **dict.fromkeys(velocities, 1e-9)})
    boundaries = [i for i, c in enumerate(equations.system.contacts) if not c.kind.led]
    for i in boundaries:
        contact = equations.system.contacts[i].name
        for label, offset in (("on", 0.0), (f"{GRAZE:g} inside", -GRAZE), (f"{GRAZE:g} outside", GRAZE)):
            start = on_boundary(equations, {i: offset})
            if start is not None:
                yield case(f"start {label} {contact}", start, quick=offset == 0.0)
    for pair in itertools.combinations(boundaries, 2):
        start = on_boundary(equations, dict.fromkeys(pair, 0.0))
        if start is not None:
            names = " and ".join(equations.system.contacts[i].name for i in pair)
            yield case(f"start on {names}", start)


def _drives(name: str, equations: StressEquations, duration: float) -> Iterator[Case]:
    inputs = equations.inputs
    if len(inputs) > 1:
        equal = dict.fromkeys(inputs, next(iter(inputs.values())))
        yield Case(name, "friction", "drive", "drives equal", inputs=equal, duration=duration, quick=True)
        opposed = {u: value * (-1) ** i for i, (u, value) in enumerate(equal.items())}
        yield Case(name, "friction", "drive", "drives opposed", inputs=opposed, duration=duration)


def on_boundary(equations: StressEquations, offsets: Mapping[int, float]) -> dict[str, float] | None:
    """Start values with each contact (by index) off its boundary by so much of the default's scale; None if impossible.

    A contact with a bound is put there without speed, one without at that slip speed. Newton's method by least
    squares: the boundaries are smooth, mostly affine.
    """
    names = list(equations.starts)
    x = np.array([equations.starts[n] for n in names])

    def wrong(at: np.ndarray) -> np.ndarray:
        columns = {name: np.array([value]) for name, value in zip(names, at, strict=True)} | {"time": np.zeros(1)}
        columns |= {f"{c.name}_state": np.full(1, 2.0) for c in equations.system.contacts}
        values = equations.environment(columns, {})
        rows = []
        for i, offset in offsets.items():
            contact = equations.system.contacts[i]
            slip, size = equations.place(i, values, "slip")
            if contact.depth is None:
                rows.append(float(np.squeeze(slip)) - offset * max(1.0, float(np.squeeze(size))))
            else:
                depth, size = equations.place(i, values, "depth")
                rows.append(float(np.squeeze(depth)) + offset * float(np.squeeze(size)))
                if not contact.kind.rubs:
                    rows.append(float(np.squeeze(slip)))
        return np.array(rows)

    for _ in range(8):
        violated = wrong(x)
        slopes = []
        for i in range(len(x)):
            step = 1e-6 * max(1.0, abs(x[i])) * np.eye(len(x))[i]
            slopes.append((wrong(x + step) - wrong(x - step)) / (2 * step[i]))
        move = np.linalg.lstsq(np.array(slopes).T, violated, rcond=None)[0]
        if np.abs(move).max() <= 1e-16 * max(1.0, float(np.abs(x).max())):
            break
        x = x - move
    if not np.isfinite(x).all() or np.abs(wrong(x)).max() > 1e-9 * max(1.0, float(np.abs(x).max())):
        return None
    return {name: float(value) for name, value in zip(names, x, strict=True)}


def characteristic_period(model: Model, equations: StressEquations) -> float:
    """Longest period, s, of what moves by itself at the start and of what is driven; 1 where nothing swings."""
    names = [*equations.starts]
    driven = equations.driven
    point = {name: np.array([value]) for name, value in equations.starts.items()} | {"time": np.zeros(1)}
    point |= {f"{c.name}_state": np.full(1, 2.0) for c in equations.system.contacts}
    point |= {f"{c.name}_force": np.zeros(1) for c in equations.system.contacts}

    def rates(columns: Mapping[str, np.ndarray]) -> np.ndarray:
        return equations.rates(columns, {})[0][:, 0]

    matrix = np.zeros((len(names), len(names)))
    for i, name in enumerate(names):
        step = 1e-6 * max(1.0, abs(equations.starts[name]))
        up, down = ({**point, name: point[name] + s * step} for s in (1, -1))
        for row, value in zip(driven, (rates(up) - rates(down)) / (2 * step), strict=True):
            matrix[names.index(row), i] = value
    if isinstance(model, Mechanism):
        for q in model.coordinates:
            matrix[names.index(q.name), names.index(q.v.name)] = 1.0
    natural = np.abs(np.linalg.eigvals(matrix).imag)
    frequencies = [float(w) for w in natural if w > 1e-6 * max(1.0, natural.max())]
    frequencies += [equations.parameters[r.name] * _turn(model, r.name) for r in roles(model) if r.does == "frequency"]
    return 2 * math.pi / min((w for w in frequencies if w > 0), default=2 * math.pi)


def _turn(model: Model, name: str) -> float:
    """Radians per second of a frequency: 2 pi if it is in cycles."""
    (symbol,) = [p for p in model.parameters if p.name == name]
    expressions = list(model.flows.values()) if isinstance(model, Automaton) else list(model.applied.values())
    for wave in (wave for expression in expressions for wave in expression.atoms(sympy.Function)):
        slope = sympy.diff(wave.args[0], TIME, symbol)
        if slope != 0:
            return float(slope)
    return 1.0
