"""Where a branch of cycles ends at a saddle: the cycle stays ever longer near it, and the period is without end.

    the slowest point of the cycle, Newton's method from there    -> the equilibrium, and its eigenvalues
    value = value_h + a e + b e^2 + ...,   e = exp(-rate period)  -> value_h, by a polynomial through motions

The rate is that of the eigenvalue next to the imaginary axis: the time near a saddle is the logarithm of how far the
motion misses it, over the rate at which it leaves or comes, whichever is slower.

Source: Kuznetsov, Elements of Applied Bifurcation Theory (2004), section 6.2.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fmu_models.base.arrays import Complex
from fmu_models.continuation.problem.flow import FlowProblem
from fmu_models.continuation.problem.imported import ImportedProblem
from fmu_models.continuation.problem.node import Lost, Node, extrapolated
from fmu_models.continuation.problem.problem import Vector
from fmu_models.continuation.special.shrunk_cycle import equilibrium_near

# how much longer than the shortest period the last one is, at least; points of a cycle that are looked at
LONGER, SAMPLES = 2.0, 257
# shares e, over that of the shortest period, of motions that the value is extrapolated from; how well it is known,
# in the range of the parameter
SHARES, KNOWN = np.geomspace(1e-2, 1e-6, 6), 1e-6


@dataclass(frozen=True, eq=False)
class HomoclinicEnd:
    """The saddle, its eigenvalues (1/s), and the value of the parameter."""

    point: Vector
    eigenvalues: Complex
    value: float


def homoclinic_end(nodes: Sequence[Node]) -> HomoclinicEnd | None:
    """The saddle that the last motions of a branch come to; None if they come to none."""
    last = nodes[-1]
    problem = last.problem
    if not isinstance(problem, FlowProblem) or isinstance(problem, ImportedProblem) or not problem.autonomous:
        return None
    same = [node for node in nodes if node.word == last.word and node.problem.autonomous]
    shortest = min(node.seen.length for node in same)
    if last.seen.length < LONGER * shortest:
        return None
    try:
        saddle = equilibrium_near(problem, _slowest(problem, last), last.z[-1], last.scales, last.seen.length / SAMPLES)
    except Lost:
        return None
    point, eigenvalues = saddle
    rates = eigenvalues.real
    if not (rates.max() > 0.0 > rates.min()):
        return None
    rate = min(rates[rates > 0.0].min(), -rates[rates < 0.0].max())
    small = np.exp(-rate * (np.array([node.seen.length for node in same]) - shortest))
    chosen = sorted({int(np.abs(np.log(small / share)).argmin()) for share in SHARES})
    if len(chosen) < 3:
        return None
    values = np.array([node.value for node in same])
    estimates = [float(extrapolated(small[part], values[part])) for part in (chosen, chosen[:-1], chosen[1:])]
    if np.ptp(estimates) > KNOWN * last.scales[-1]:
        return None
    return HomoclinicEnd(point, eigenvalues, estimates[0])


def _slowest(problem: FlowProblem, node: Node) -> Vector:
    """The point of a cycle at which it moves least."""
    n = len(problem.states)
    begin = np.zeros(len(problem.strobe.states))
    begin[:n] = node.z[:n]
    times = np.linspace(0.0, node.seen.length, SAMPLES)
    moved = problem.strobe.at(**problem.values(node.z)).trajectory(begin, times)
    points = np.array([moved[name] for name in problem.states]).T
    steps = np.abs(np.diff(points, axis=0) / node.scales[:n]).max(axis=1)
    return points[int(steps.argmin())]
