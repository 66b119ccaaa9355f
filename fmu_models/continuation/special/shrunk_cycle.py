"""The equilibrium that a cycle shrinks to, and the Hopf point there.

An equilibrium is a fixed point of the motion over any time. Over a fixed share of the cycle's period its multipliers
are exp(lambda t), of modulus 1 at the Hopf point: a simple root, where the cycle itself only tends to it.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import newton

from fmu_models.base.arrays import Complex
from fmu_models.continuation.problem.flow import FlowProblem
from fmu_models.continuation.problem.node import Lost, Node, parameter, solved
from fmu_models.continuation.problem.problem import Vector
from fmu_models.sections.strobe import strobe_of

SMALL = 1e-2  # of the scales of the states: a cycle that is smaller is near its end
SHARE = 0.25  # of the period, over which an equilibrium is looked at: not so much that multipliers come back to 1
NEAR = 1e-2  # of the range of the parameter: the Hopf point is no farther from a small cycle


def amplitude(node: Node) -> float:
    """How large a cycle is, about, in scales: its speed at the start over its frequency."""
    n = len(node.problem.states)
    rates = node.seen.jacobian[-1, :n] / node.scales[:n]
    return float(np.abs(rates).max()) * node.seen.length / (2.0 * np.pi)


def equilibrium_near(
    cycle: FlowProblem, point: Vector, value: float, scales: Vector, seconds: float
) -> tuple[Vector, Complex]:
    """The equilibrium near a point, which is a fixed point over any time; its eigenvalues, 1/s. Lost: there is none.

    Args:
        scales: of the unknowns of the cycle.
        seconds: over which it is looked at.
    """
    problem, scales = _at_rest(cycle, scales, seconds)
    node = solved(problem, scales, np.append(point, value) / scales, parameter(value), reach=1.0)
    eigenvalues: Any = np.log(node.multipliers) / seconds
    return node.z[:-1], eigenvalues


def _at_rest(cycle: FlowProblem, scales: Vector, seconds: float) -> tuple[FlowProblem, Vector]:
    """Of equilibria, fixed points over any time, and the scales of their unknowns: those of a cycle but its length."""
    problem = replace(cycle, strobe=strobe_of(cycle.strobe, period=seconds), kept=cycle.kept)
    return problem, np.delete(scales, -2)


def hopf_of(node: Node) -> Node | None:
    """The equilibrium at the Hopf point where a small cycle ends; None if it does not end there."""
    cycle = node.problem
    if not isinstance(cycle, FlowProblem) or not cycle.autonomous or amplitude(node) > SMALL or node.word:
        return None
    problem, scales = _at_rest(cycle, node.scales, SHARE * node.seen.length)
    n = len(cycle.states)
    solved_nodes: list[Node] = []

    def modulus(value: float) -> float:
        guess = np.append(node.z[:n] if not solved_nodes else solved_nodes[-1].z[:n], value)
        solved_nodes.append(solved(problem, scales, guess / scales, parameter(value), reach=1.0))
        return float(np.abs(solved_nodes[-1].multipliers).max()) - 1.0

    try:
        value = float(np.asarray(newton(modulus, node.value, x1=node.value + 1e-4 * scales[-1], tol=1e-15, maxiter=30)))
    except (Lost, RuntimeError):
        return None
    nearest_node = solved_nodes[-1]
    if abs(nearest_node.multipliers[0].imag) < 1e-6 or abs(value - node.value) > NEAR * scales[-1]:
        return None
    return nearest_node
