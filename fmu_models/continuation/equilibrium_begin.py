"""The equilibrium that a branch begins at."""

from __future__ import annotations

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.continuation.problem.equilibrium import EquilibriumProblem, numbers_of, problem_at
from fmu_models.continuation.problem.imported_field import ImportedField
from fmu_models.continuation.problem.node import Lost, Node, look, parameter, scaled, solved
from fmu_models.continuation.problem.problem import Vector
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.contact_kinds import STICK
from fmu_models.simulation.field import VectorField
from fmu_models.simulation.run import check_names, check_value

# condition number beyond which an equilibrium does not stand alone
ALONE = 1e12


def start_of(
    fmu: Fmu, over: str, between: tuple[float, float], start: dict[str, float], constants: dict[str, float]
) -> tuple[EquilibriumProblem, Vector]:
    """The problem, and z of the start.

    Args:
        between: range of the parameter, which holds its present value.
        start: states near it; as the declaration says what is left out.
        constants: values of parameters and inputs that are not at their default.

    Raises:
        StickslipError: unknown names or values out of their range, no Model Exchange, a model that is forced.
    """
    check_names(fmu, "parameter or input", constants, numbers_of(fmu))
    check_names(fmu, "state", start, fmu.states)
    for name, value in {**constants, **start}.items():
        check_value(fmu, name, value)
    point = np.array([float(start.get(state, fmu.variables[state].start or 0.0)) for state in fmu.states])
    field = (VectorField if fmu.ours else ImportedField)(fmu, constants)
    problem = problem_at(field, over, constants, point, between)
    return problem, np.append(point, problem.value_within(between))


def begin_of(problem: EquilibriumProblem, z: Vector, scales: Vector) -> Node:
    """The equilibrium near a start.

    Raises:
        StickslipError: there is none, or none that stands alone.
    """
    try:
        node = solved(problem, scales, z / scales, parameter(float(z[-1])), reach=np.inf, halvings=20)
    except Lost:
        raise StickslipError(_why(problem, z)) from None
    if any(state == STICK for _, state, _ in node.word) and np.linalg.cond(scaled(node)[:, :-1]) > ALONE:
        raise StickslipError(_why(problem, node.z))
    return node


def _why(problem: EquilibriumProblem, z: Vector) -> str:
    """What there is instead of an equilibrium that stands alone."""
    seen, n = look(problem, z), len(problem.states)
    if seen is not None and np.abs(seen.residual / problem.scales(z, (0.0, 1.0))[:n]).max() < 1e-9:
        sticking = [name for name, state, _ in seen.word if state == STICK]
        stuck = f": {', '.join(sticking)} sticks, and the equilibria around are as good" if sticking else ""
        return (
            f"'{problem.name}' is at rest at the start, but that equilibrium does not stand alone{stuck}. A branch "
            "needs one that does: start where it slips, or free it."
        )
    missed = (
        "" if seen is None else f" (rates there: {', '.join(f'{rate:.3g}' for rate in seen.residual / problem.share)})"
    )
    name = problem.name
    return f"No equilibrium of '{name}' was found near that start{missed}. Start nearer, or let a run settle first."
