"""What attractors are, at random parameters of five families, against plain iteration and Runge-Kutta steps.

    python tests/benchmarks/bench_attractors.py [draws] [family ...]

A draw is one start at random parameters. The verdict is judged by what plain code does from a point of the attractor
on: whether it is back after the period that is claimed, after another one where none is, and what a difference grows
by. Wrong: a period that does not come back, no period where there is one, chaos or torus against that growth.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import sympy

from fmu_models import TIME, Automaton, Fmu, Iteration, Map, Parameter, State, Strobe, basins, load
from fmu_models.analyses.unforced import LimitCycle
from fmu_models.base.arrays import Vector
from fmu_models.families.execution import Execution
from fmu_models.maps.henon import MAP as HENON
from fmu_models.maps.logistic import MAP as LOGISTIC
from fmu_models.sections.system import SectionSystem

SEED = 20
ALONE = Execution(workers=1)
BACK = 1e-5  # of a motion that repeats itself: by how much plain steps miss
LONGEST = 64
CHAOTIC = 5e-3  # growth of a difference per step; plain means of a few thousand steps are not finer
DRAWN = ("period", "chaos", "torus", "equilibrium", "not decided", "to infinity")
Field = Callable[[Vector, Any, float], Vector]


def circle_map() -> Map:
    k, w = Parameter("K", 0.5, "1", "strength"), Parameter("W", 0.3, "1", "turns in a step")
    t = State("t", "1", "turns", start=0.1)
    rule: Any = {t: t + w - k / (2 * sympy.pi) * sympy.sin(2 * sympy.pi * t)}
    return Map(name="circle", title="circle", source="here", states=[t], rule=rule, box={t: (0.0, 1.0)},
               modulus={t: sympy.Integer(1)})  # fmt: skip


@cache
def ueda() -> Fmu:
    """x'' + d x' + x^3 = B cos t."""
    rate, w = (Parameter(name, 1.0, "rad/s", name, positive=True) for name in ("rate", "w"))
    d, b = Parameter("d", 0.1, "1", "damping"), Parameter("B", 7.5, "1", "amplitude")
    x, v = State("x", "1", "x", start=0.5), State("v", "1", "v", start=0.0)
    flows: Any = {x: rate * v, v: rate * (b * sympy.cos(w * TIME) - d * v - x**3)}
    return load(Automaton(name="ueda", title="ueda", source="here", states=[x, v], flows=flows))


@cache
def roessler() -> Fmu:
    rate, a, c = Parameter("rate", 1.0, "1/s", "rate", positive=True), *(Parameter(n, 0.2, "1", n) for n in "ac")
    x, y, z = (State(n, "1", n, start=1.0) for n in "xyz")
    flows: Any = {x: -rate * (y + z), y: rate * (x + a * y), z: rate * (sympy.Rational(1, 5) + z * (x - c))}
    return load(Automaton(name="roessler", title="roessler", source="here", states=[x, y, z], flows=flows))


@dataclass(frozen=True)
class Family:
    """system at values of its parameters, their ranges and those of its starts; plain: a step, or rates where ``step``
    is a length > 0, of ``in_one`` a step of the section."""

    system: Callable[[Mapping[str, float]], SectionSystem]
    parameters: Mapping[str, tuple[float, float]]
    box: Mapping[str, tuple[float, float]]
    plain: Field
    count: int
    step: float = 0.0
    in_one: int = 1


def _logistic(x: Vector, p: Any, t: float) -> Vector:
    return p["r"] * x * (1 - x)


def _henon(x: Vector, p: Any, t: float) -> Vector:
    return np.array([1 - p["a"] * x[0] ** 2 + x[1], p["b"] * x[0]])


def _circle(x: Vector, p: Any, t: float) -> Vector:
    return x + p["W"] - p["K"] / (2 * np.pi) * np.sin(2 * np.pi * x)


def _ueda(x: Vector, p: Any, t: float) -> Vector:
    return np.array([x[1], p["B"] * np.cos(t) - p["d"] * x[1] - x[0] ** 3])


def _roessler(x: Vector, p: Any, t: float) -> Vector:
    return np.array([-x[1] - x[2], x[0] + p["a"] * x[1], 0.2 + x[2] * (x[0] - p["c"])])


def mapped(declared: Map) -> Callable[[Mapping[str, float]], SectionSystem]:
    return lambda values: Iteration.of(declared, values)


FAMILIES = {
    "circle": Family(mapped(circle_map()), {"K": (0.0, 0.98), "W": (0.0, 1.0)}, {"t": (0.0, 1.0)}, _circle, 100_000),
    "logistic": Family(mapped(LOGISTIC), {"r": (2.8, 4.0)}, {"x": (0.1, 0.9)}, _logistic, 100_000),
    "henon": Family(mapped(HENON), {"a": (0.2, 1.4), "b": (0.1, 0.3)}, {"x": (-0.3, 0.3)}, _henon, 100_000),
    "ueda": Family(lambda values: Strobe(ueda(), forcing="w", parameters=values), {"d": (0.05, 0.3), "B": (1.0, 12.0)},
                   {"x": (-3.0, 3.0), "v": (-3.0, 3.0)}, _ueda, 2_000, 2 * np.pi / 300, 300),
    "roessler": Family(lambda values: Strobe(roessler(), parameters=values), {"a": (0.1, 0.3), "c": (2.0, 8.0)},
                       {"x": (-3.0, 3.0), "y": (-3.0, 3.0)}, _roessler, 3_000, 0.01, 100),
}  # fmt: skip


@dataclass
class Draw:
    """kind: one of ``DRAWN``; period in steps, or s of a flow; point: (n,) on the attractor."""

    values: dict[str, float]
    kind: str
    period: float
    point: Vector
    word: str
    cost: float


def drawn(family: Family, rng: np.random.Generator) -> Draw:
    values, start = ({n: float(rng.uniform(*ends)) for n, ends in of.items()} for of in (family.parameters, family.box))
    begin, system = time.process_time(), family.system(values)
    axes: Any = {n: [x] for n, x in start.items()}
    found = basins(system, execution=ALONE, **axes)
    cost, label = time.process_time() - begin, int(found.labels.ravel()[0])
    if label < 0:
        return Draw(values, DRAWN[4 if label == -1 else 5], 0.0, system.start(start), "", cost)
    attractor, word = found.attractors[label], found.attractors[label].word
    kind = word if word in DRAWN else "equilibrium" if word.startswith("equil") else "period"
    period = attractor.time if isinstance(attractor, LimitCycle) else attractor.period
    return Draw(values, kind, float(period), attractor.points[-1 if kind in DRAWN[1:3] else 0], word, cost)


def plain_steps(family: Family, x: Vector, p: Any, t: float) -> Vector:
    """A step of the section, or so many lengths of a flow, by Runge and Kutta."""
    if not family.step:
        return family.plain(x, p, t)
    h, f = family.step, family.plain
    for k in range(family.in_one):
        s = t + k * h
        k1 = f(x, p, s)
        k2 = f(x + h / 2 * k1, p, s + h / 2)
        k3 = f(x + h / 2 * k2, p, s + h / 2)
        x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + f(x + h * k3, p, s + h))
    return x


def judged(family: Family, draws: list[Draw]) -> tuple[Vector, Vector]:
    """(m,) growth of a difference per step of the section, and least period in steps, 0 for none to ``LONGEST``."""
    x = np.array([draw.point for draw in draws]).T
    p = {name: np.array([draw.values[name] for draw in draws]) for name in family.parameters}
    # two motions side by side, brought near again after each step
    both = np.stack([x, x + 1e-8 * (np.arange(len(x)) == 0)[:, None]], axis=-1)
    p = {name: values[:, None] for name, values in p.items()}
    growth, kept = np.zeros(len(draws)), []
    for k in range(family.count):
        both = plain_steps(family, both, p, 0.0)
        difference = both[..., 1] - both[..., 0]
        size = np.sqrt((difference**2).sum(axis=0)) + 1e-300
        growth += np.log(size / 1e-8)
        both[..., 1] = both[..., 0] + 1e-8 * difference / size
        if k >= family.count - 2 * LONGEST:
            kept.append(both[..., 0])
    trace, periods = np.array(kept), np.zeros(len(draws))
    for n in range(LONGEST, 0, -1):
        missed = np.abs(trace[n:] - trace[:-n])
        if family.plain is _circle:
            missed = np.abs(missed - np.round(missed))
        periods[(missed < BACK).all(axis=(0, 1))] = n
    return growth / family.count, periods


def wrong(family: Family, draw: Draw, growth: float, period: float) -> bool:
    flow = family.plain is _roessler
    if draw.kind == "period" and flow:
        p, x = draw.values, draw.point
        whole = Family(family.system, {}, {}, family.plain, 0, draw.period / 40_000, 40_000)
        return bool(np.abs(plain_steps(whole, x, p, 0.0) - x).max() > BACK)
    if draw.kind == "period":
        return period != draw.period
    if draw.kind == "chaos":
        return bool(period) or growth < (0.0 if not flow else 1e-3)
    return draw.kind == "torus" and (bool(period) or growth > CHAOTIC)


def main(count: int, names: list[str]) -> None:
    heads = ("family", "draws", *DRAWN, "wrong", "s a draw")
    print(" ".join(f"{head:>11}" for head in heads))
    for name in names:
        family, rng = FAMILIES[name], np.random.default_rng(SEED)
        draws = [drawn(family, rng) for _ in range(count)]
        settled = [draw for draw in draws if draw.kind not in DRAWN[3:]]
        judgements = zip(settled, *judged(family, settled), strict=True)
        bad = [(d, g, p) for d, g, p in judgements if wrong(family, d, g, p)]
        counts = [sum(draw.kind == kind for draw in draws) for kind in DRAWN]
        row = (name, count, *counts, len(bad), f"{sum(draw.cost for draw in draws) / count:.3f}")
        print(" ".join(f"{cell:>11}" for cell in row), flush=True)
        for draw, growth, period in bad:
            print(f"    wrong: {draw.word} at {draw.values}: growth {growth:.4g}, period {period:g}")
        for draw in (d for d in draws if d.kind == DRAWN[4]):
            print(f"    not decided: '{draw.word}' at {draw.values}")


if __name__ == "__main__":
    main(int((sys.argv[1:] or ["200"])[0]), sys.argv[2:] or list(FAMILIES))
