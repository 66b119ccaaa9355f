"""Points of codimension 2 on a curve: functions that change their signs there, by what the point is.

    of all             another multiplier passes +1, -1 or, in a pair, the circle
    fold               cusp: both parameters turn
    flip, pitchfork,   the cubic coefficient of the normal form vanishes (normal_forms/cubic.py)
    Neimark-Sacker
    Neimark-Sacker     the angle of the pair of multipliers is that of a strong resonance, a whole turn over 1 to 4
    Hopf               the frequency vanishes
    where the word     a multiplier of the motion with its event passes +1, -1 or the circle, too: the limit of those of
    changes            runs that are displaced so far that the event happens

Source: Kuznetsov, Elements of Applied Bifurcation Theory (2004), sections 8.1, 9.1; di Bernardo et al.,
Piecewise-smooth Dynamical Systems (2008), chapter 9, for those where a motion touches something.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache

import numpy as np

from fmu_models.base.arrays import Complex
from fmu_models.continuation.curves.condition import Condition, Miss
from fmu_models.continuation.normal_forms.cubic import coefficient
from fmu_models.continuation.problem.node import Node, extrapolated, look, passing_test
from fmu_models.continuation.problem.problem import Passing, Seen, Vector
from fmu_models.continuation.special.discontinuous import new_event
from fmu_models.continuation.special.kinds import FLIP, FOLD, HOPF, KINDS, NEIMARK_SACKER

# what it is that another multiplier passes
_PASSES = {KINDS[kind].passes: kind for kind in (FOLD, FLIP, NEIMARK_SACKER)}
# what a smooth point is where another multiplier passes something
_SMOOTH = {
    **{("fold", "+1"): "1:1 resonance", ("fold", "-1"): "fold-flip", ("fold", "circle"): "fold-Neimark-Sacker"},
    **{("flip", "+1"): "fold-flip", ("flip", "-1"): "1:2 resonance", ("flip", "circle"): "flip-Neimark-Sacker"},
    ("Neimark-Sacker", "+1"): "fold-Neimark-Sacker",
    ("Neimark-Sacker", "-1"): "flip-Neimark-Sacker",
    ("Neimark-Sacker", "circle"): "double Neimark-Sacker",
    **{("Hopf", "+1"): "fold-Hopf", ("Hopf", "circle"): "double Hopf"},
    **{("pitchfork", "+1"): "1:1 resonance", ("pitchfork", "-1"): "pitchfork-flip"},
    ("pitchfork", "circle"): "pitchfork-Neimark-Sacker",
}
# the cubic coefficient of what vanishes where
_CUBIC = {kind.degenerate: name for name, kind in KINDS.items() if kind.degenerate}
# the cosine of the angle of a pair
_RESONANCES = {"1:1 resonance": 1.0, "1:2 resonance": -1.0, "1:3 resonance": -0.5, "1:4 resonance": 0.0}
# where the pair of a curve becomes real: beyond, its determinant vanishes at saddles
REAL = ("1:1 resonance", "1:2 resonance", "Bogdanov-Takens")
HOLDS = 1e-3  # of its values at both ends, as which a function is none where it vanishes
# starts are displaced by squares of whole numbers times this, in u, and the speed of the event grows by whole numbers
DEPTH, DEPTHS = 1e-9, (1, 2, 3, 4)

Function = Callable[[Node, Node], float]  # of a motion on the curve and of its neighbour; nan where it is not known


def functions(kind: str, condition: Condition) -> Mapping[str, Function]:
    """Those of a curve of a kind, by the name of the point."""
    if isinstance(condition, Miss):
        return _where_the_word_changes(kind, condition)
    tests: dict[str, Function] = {}
    for test in _PASSES:
        if (kind, test) in _SMOOTH:
            tests[_SMOOTH[kind, test]] = lambda node, before, test=test: _tests(_others(kind, node))[test]
    if kind == FOLD:
        tests["cusp"] = _turned
    if KINDS[kind].degenerate:
        tests[KINDS[kind].degenerate] = lambda node, before: coefficient(kind, node).value
    if kind == NEIMARK_SACKER:
        for name, cosine in _RESONANCES.items():
            tests[name] = lambda node, before, cosine=cosine: _cosine(node) - cosine
    if kind == HOPF:
        tests["Bogdanov-Takens"] = lambda node, before: _cosine(node) - 1.0
    return tests


def _where_the_word_changes(kind: str, condition: Miss) -> Mapping[str, Function]:
    tests: dict[str, Function] = {}
    for test, name in _PASSES.items():
        tests[f"{kind} and {name}"] = lambda node, before, test=test: _tests(_own(node))[test]
        if not condition.like.turned:
            with_event = f"{kind} and {name} with its event"
            tests[with_event] = lambda node, before, test=test: _with_event(condition, node, test)
    return tests


def _own(node: Node) -> Complex:
    return node.problem.own(node.multipliers)


def _pairs(multipliers: Complex) -> Iterator[tuple[float, int, int]]:
    """How far products are from 1, and of which multipliers."""
    return ((abs(multipliers[i] * multipliers[j] - 1.0), i, j) for i in range(len(multipliers)) for j in range(i))


def _others(kind: str, node: Node) -> Complex:
    """Multipliers but for those that the curve is about."""
    multipliers, passes = _own(node), KINDS[kind].passes
    if passes == "circle":
        return np.delete(multipliers, min(_pairs(multipliers))[1:])
    return np.delete(multipliers, np.abs(multipliers - float(passes)).argmin())


def _cosine(node: Node) -> float:
    """Of the angle of the pair of multipliers."""
    multipliers = _own(node)
    _, i, j = min(_pairs(multipliers))
    return float((multipliers[i] + multipliers[j]).real) / 2.0


def _tests(multipliers: Complex) -> dict[str, float]:
    """By what passes; nan for the circle where all of them are real."""
    tests = {passes: passing_test(multipliers, passes) for passes in _PASSES}
    turning = len(multipliers) > 1 and (np.abs(multipliers.imag) > 1e-9).any()
    return tests if turning else {**tests, "circle": np.nan}


def _turned(node: Node, before: Node) -> float:
    """How fast the parameters change, in the direction that they do at the neighbour."""
    direction = _rates(before)
    size = float(np.linalg.norm(direction))
    return float(_rates(node) @ direction) / size if size else np.nan


def _rates(node: Node) -> Vector:
    return node.tangent[[len(node.problem.states), -1]]


def _with_event(condition: Miss, node: Node, test: str) -> float:
    limit = _limit(condition, node)
    return np.nan if limit is None else _tests(node.problem.own(node.problem.multipliers(limit)))[test]


@lru_cache(maxsize=8)
def _limit(condition: Miss, node: Node) -> Vector | None:
    """The monodromy matrix with the event, whose speed vanishes; None where there is none, or it has no limit."""
    miss = condition.of(node)
    if node.problem.is_rigid(miss.contact):
        return None
    return limit_with_event(node, condition.place(node), miss)


def limit_with_event(node: Node, z: Vector, miss: Passing) -> Vector | None:
    """The limit of monodromy matrices of runs from beside z that have an event, whose speed vanishes; None where they
    have none.

    Args:
        node: of the motion without the event, so near z that it has the same matrix.
        miss: its near miss.
    """
    runs = [displaced(node, z, miss, DEPTH * depth**2) for depth in DEPTHS]
    existing = [run for run in runs if run is not None]
    if len(existing) < len(runs):
        return None
    return extrapolated([event.value for event, _ in existing], np.array([seen.monodromy for _, seen in existing]))


def displaced(node: Node, z: Vector, miss: Passing, depth: float) -> tuple[Passing, Seen] | None:
    """The event that a miss becomes, and the run, from a start that lies so deep, in u, beyond z."""
    down = miss.gradient * node.scales
    down[node.problem.width :] = 0.0
    size = float(np.linalg.norm(down))
    seen = look(node.problem, z - depth * down / size * node.scales) if size else None
    event = None if seen is None else new_event(seen, node.seen, miss)
    return None if seen is None or event is None else (event, seen)


def holds(name: str, value: float, ends: tuple[float, float], node: Node, before: Node) -> bool:
    """Whether a function vanishes where it has changed its sign: it may have a pole there, too."""
    if name == "cusp":
        return bool(np.linalg.norm(_rates(node)) < HOLDS * np.linalg.norm(_rates(before)))
    largest = max(abs(end) for end in ends)
    # a coefficient that vanishes all along the curve changes its sign by rounding
    if name in _CUBIC and largest <= coefficient(_CUBIC[name], node).error:
        return False
    return abs(value) < HOLDS * largest
