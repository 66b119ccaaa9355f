"""The branches of cycles that are born at an equilibrium.

    Hopf                along the eigenvector of the pair on the imaginary axis, at a small amplitude, with its period
    discontinuous Hopf  the cycle is as large as the equilibrium is far from the surface: on either side of the point,
                        one turn from starts ever farther out, in the plane of the pair on the axis, tells where motions
                        begin to come nearer instead of going away, or the other way round. That is a cycle.

Source: Kuznetsov, Elements of Applied Bifurcation Theory (2004), section 10.2; for the scaling of what is born at a
surface, Leine and van Campen, European Journal of Mechanics A/Solids 25 (2006), section 2.
"""

from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import brentq

from fmu_models.base.errors import StickslipError
from fmu_models.continuation.branch import Branch, followed_from
from fmu_models.continuation.problem.equilibrium import equilibrium_problem
from fmu_models.continuation.problem.flow import FlowProblem
from fmu_models.continuation.problem.imported import ImportedProblem
from fmu_models.continuation.problem.node import Lost, Node, arclength, parameter, solved
from fmu_models.continuation.problem.problem import Vector
from fmu_models.continuation.special.boundary import Boundary
from fmu_models.sections.strobe import Strobe
from fmu_models.simulation.sections import Section, SectionFollower

SMALL = (0.02, 0.05, 0.1)  # amplitudes, in scales of the states, at which a cycle is looked for beside a Hopf point
# how far from the point at a surface its cycles are looked for, in u; how often their size is doubled, from that on
ASIDE, DOUBLINGS = 0.01, 9
TURN = 5.0  # periods that one turn takes at most


def cycles_from_hopf(node: Node, frequency: float, between: tuple[float, float], points: int) -> tuple[Branch, ...]:
    """The branch that leaves at a Hopf point of so many rad/s."""
    n, period = len(node.problem.states), 2.0 * np.pi / frequency
    problem = _cycles(node, period)
    scales = _with_period(node.scales, period)
    direction = np.zeros_like(scales)
    direction[:n] = _plane(node.seen.monodromy, node.scales[:n])[0]
    u = _with_period(node.z, period) / scales
    for amplitude in SMALL:
        border = arclength(u, direction, scales, amplitude)
        try:
            cycle = solved(problem, scales, u + amplitude * direction, border, towards=direction)
        except Lost:
            continue
        return (followed_from(cycle, between, points),)
    return ()


def cycles_from_boundary(
    boundary: Boundary, frequency: float, between: tuple[float, float], points: int
) -> tuple[Branch, ...]:
    """Those that are born where a pair of about so many rad/s jumps over the imaginary axis."""
    assert boundary.after is not None
    shares = np.array(boundary.crossings["imaginary axis"])
    followed: list[Branch] = []
    for side, sense in ((boundary.before, -1.0), (boundary.after, 1.0)):
        guess = boundary.u + sense * ASIDE * side.tangent
        try:
            at = solved(side.problem, side.scales, guess, parameter(guess[-1] * side.scales[-1]), word=side.word)
        except Lost:
            continue
        cycle = _around(at, boundary, float(shares[0]), frequency)
        if cycle is None:
            continue
        away = np.sign(at.value - boundary.z[-1])
        followed.append(followed_from(cycle if cycle.tangent[-1] * away > 0.0 else cycle.turned(), between, points))
    return tuple(followed)


def _around(at: Node, boundary: Boundary, share: float, frequency: float) -> Node | None:
    """A cycle around an equilibrium near the surface."""
    n = len(at.problem.states)
    plane = _plane(boundary.between(share), at.scales[:n])
    i = int(np.abs(plane).max(axis=0).argmax())
    # the direction of the plane in which state i does not change
    out = plane[0] * plane[1][i] - plane[1] * plane[0][i]
    out /= np.linalg.norm(out)
    scales, centre, period = at.scales[:n], at.u[:n], 2.0 * np.pi / frequency

    def turn(amplitude: float) -> tuple[float, float]:
        """How much farther out the motion is after one turn, in logarithms, and how long that takes."""
        x = (centre + amplitude * out) * scales
        time, end = _returned(at, x, i, TURN * period)
        return float(np.log(max(float((end / scales - centre) @ out), 1e-300) / amplitude)), time

    sizes = ASIDE * 2.0 ** np.arange(DOUBLINGS)
    for low, high in pairwise(sizes):
        try:
            if turn(low)[0] * turn(high)[0] >= 0.0:
                continue
            size: Any = brentq(lambda radius: turn(radius)[0], low, high, xtol=1e-9)
            length = turn(size)[1]
            problem, cycle_scales = _cycles(at, length), _with_period(at.scales, length)
            z = np.concatenate([(centre + size * out) * scales, [length, at.value]])
            return solved(problem, cycle_scales, z / cycle_scales, parameter(at.value))
        except (Lost, StickslipError):
            continue
    return None


def _returned(at: Node, x: Vector, i: int, within: float) -> tuple[float, Vector]:
    """When and where the motion from x passes the level that state i begins at, in the same sense. StickslipError: it
    does not."""
    problem = equilibrium_problem(at)
    fmu, constants = problem.field.fmu, {**problem.strobe.values, **problem.values(at.z)}
    if not fmu.ours:
        raise StickslipError(f"'{fmu.description.modelName}' is not of this suite: no turn around its surface is made.")
    sense = int(np.sign(problem.field.at(x, constants).rates[i]))
    name = fmu.states[i]
    follower = SectionFollower(fmu, Section(name, float(x[i]), sense), **fmu.settings(constants))
    passage = next(follower.follow(dict(zip(fmu.states, x.tolist(), strict=True)), within), None)
    if passage is None:
        raise StickslipError(f"The motion does not come back to {name} = {x[i]:g}.")
    return passage.time, np.array([passage.states[state] for state in fmu.states])


def _plane(j: Vector, scales: Vector) -> Vector:
    """(2, n) unit vectors of u: real and imaginary part of the eigenvector of the pair next to the imaginary axis."""
    eigen: Any = np.linalg.eig(j)
    values, vectors = eigen
    pair = np.where(values.imag > 0.0, np.abs(values.real), np.inf).argmin()
    components = np.stack([vectors[:, pair].real, vectors[:, pair].imag]) / scales
    # the two are at right angles for one phase, and no part vanishes then
    real, imaginary = components
    phase = 0.5 * np.arctan2(2.0 * real @ imaginary, real @ real - imaginary @ imaginary)
    turned = np.array([[np.cos(phase), np.sin(phase)], [-np.sin(phase), np.cos(phase)]]) @ components
    return turned / np.linalg.norm(turned, axis=1)[:, None]


def _cycles(node: Node, period: float) -> FlowProblem:
    """Cycles of the model of a branch of equilibria, of about this period."""
    problem = equilibrium_problem(node)
    fmu = problem.field.fmu
    strobe = Strobe(fmu, period=period, autonomous=True, parameters={**problem.strobe.values, problem.over: node.value})
    return (FlowProblem if fmu.ours else ImportedProblem)(strobe, problem.over)


def _with_period(numbers: Vector, period: float) -> Vector:
    return np.array([*numbers[:-1], period, numbers[-1]])
