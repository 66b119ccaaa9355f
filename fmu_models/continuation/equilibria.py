"""Branches of equilibria: followed over a parameter, stable or not, with the paths of their eigenvalues.

    smooth  folds, branch points, Hopf points (with the first Lyapunov coefficient), as for motions (special/smooth.py)
    where the branch meets a switching surface (special/boundary.py) the eigenvalues are a set, (1 - q) J- + q J+, and
    what crosses the imaginary axis names the point:

        "discontinuous Hopf"    a pair
        "discontinuous fold"    one through zero
        "multiple crossing"     more than one of these
        "boundary equilibrium"  none: the equilibrium changes sides
        "end at a surface"      the rates jump there, and no equilibrium goes on

    where a contact sticks the equilibria beside one are as good: the branch is one of sets (special/sticking_set.py)

Sources: Leine and van Campen, European Journal of Mechanics A/Solids 25 (2006), section 2; Kuznetsov, Elements of
Applied Bifurcation Theory (2004), chapters 5 and 10.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.continuation.branch import both_ways
from fmu_models.continuation.equilibrium_branch import EIGENVALUES, EquilibriumBranch, branch_of_sets, branch_of_ways
from fmu_models.continuation.kept import Keeper
from fmu_models.continuation.problem.equilibrium import ZERO, EquilibriumProblem, numbers_of, problem_at
from fmu_models.continuation.problem.imported_field import ImportedField
from fmu_models.continuation.problem.node import Lost, Node, look, parameter, scaled, solved
from fmu_models.continuation.problem.problem import Vector, range_of
from fmu_models.continuation.special.sticking_set import StickingSet, followed, set_at
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.contact_kinds import STICK
from fmu_models.simulation.field import VectorField
from fmu_models.simulation.run import check_settings

ALONE = 1e12  # condition number beyond which an equilibrium does not stand alone


def _check_of(model: str, of: str, states: Sequence[str]) -> None:
    """Raises StickslipError: neither a state nor "eigenvalues"."""
    if of not in (*states, EIGENVALUES):
        raise StickslipError(
            f"'{model}' has no state '{of}'. A picture shows one of {', '.join(states)}, or eigenvalues."
        )


def equilibria(
    fmu: Fmu,
    over: str,
    between: tuple[float, float],
    *,
    start: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    of: str | None = None,
    points: int = 2000,
    progress: Callable[[float], Any] = lambda fraction: None,
) -> EquilibriumBranch:
    """Follow the equilibrium near a start over a parameter, both ways; where a contact sticks, the set that it is of.

    Args:
        fmu: of this suite, or of others and for Model Exchange: by differences of its rates, see ``how``.
        over: name of a parameter or input.
        between: its least and largest value; its present one lies between them.
        start: states near the equilibrium; as the declaration says what is left out.
        parameters: values of parameters and inputs that are not at their default.
        of: what a picture shows, a state (the first if left out) or "eigenvalues".
        points: equilibria in each direction, at most.
        progress: called with the share of the range that is behind, or less.

    Raises:
        StickslipError: unknown names or values out of their range, no Model Exchange, a model that is forced, no
            equilibrium near the start, or none that stands alone.
    """
    clock = time.process_time()
    low, high = range_of(over, between)
    problem, z = _start(fmu, over, (low, high), dict(start or {}), dict(parameters or {}))
    _check_of(problem.name, of or problem.states[0], problem.states)
    scales = problem.scales(z, (low, high))
    sticking = None
    with suppress(Lost):  # nothing sticks, or what does has no such set
        sticking = set_at(problem, scales, z)
    if sticking is not None:
        branch = _sets(sticking, (low, high), points, progress, clock)
    else:
        first = _begin(problem, z, scales)
        directions = both_ways(first, (low, high), points, progress, Keeper(None, problem))
        branch = branch_of_ways(directions, (low, high), time.process_time() - clock)
    return replace(branch, of=of or branch.of)


def _sets(
    first_set: StickingSet, between: tuple[float, float], points: int, progress: Callable[[float], Any], clock: float
) -> EquilibriumBranch:
    """The branch of the sets of what sticks, from one of them both ways. StickslipError: they are there at one value of
    the parameter alone."""

    def tell(node: Node) -> None:
        progress((node.value - between[0]) / (between[1] - between[0]))

    forward, last = followed(first_set, between, 1.0, points, tell)
    backward, first = [first_set], last
    if last[0] != "interrupted":
        backward, first = followed(first_set, between, -1.0, points, tell)
    if len(forward) == len(backward) == 1 and {first[0], last[0]} == {"unresolved"}:
        problem = first_set.middle.problem
        sticking = ", ".join(name for name, state, _ in first_set.middle.seen.word if state == STICK)
        names = [axis for axis, e in zip(problem.states, first_set.along, strict=True) if abs(e) > ZERO]
        places = [(name, problem.states.index(name)) for name in names]
        ends = ["; ".join(f"{name} = {end[i]:.9g}" for name, i in places) for end in first_set.ends]
        raise StickslipError(
            f"The equilibrium of '{problem.name}' at the start does not stand alone: {sticking} sticks, from {ends[0]} "
            f"to {ends[1]}, and it does so at {problem.over} = {first_set.middle.value:g} alone. Follow it over "
            "another parameter."
        )
    return branch_of_sets([*reversed(backward[1:]), *forward], (first, last), time.process_time() - clock)


def _start(
    fmu: Fmu, over: str, between: tuple[float, float], start: dict[str, float], constants: dict[str, float]
) -> tuple[EquilibriumProblem, Vector]:
    """The problem, and z of the start. StickslipError: unknown names or values out of their range, no Model Exchange, a
    model that is forced."""
    check_settings(fmu, "parameter or input", constants, numbers_of(fmu))
    check_settings(fmu, "state", start, fmu.states)
    point = np.array([float(start.get(state, fmu.start_of(state))) for state in fmu.states])
    field = (VectorField if fmu.ours else ImportedField)(fmu, constants)
    problem = problem_at(field, over, constants, point, between)
    return problem, np.append(point, problem.value_within(between))


def _begin(problem: EquilibriumProblem, z: Vector, scales: Vector) -> Node:
    """The equilibrium near a start. StickslipError: there is none, or none that stands alone."""
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
    rates = "" if seen is None else ", ".join(f"{rate:.3g}" for rate in seen.residual / problem.share)
    start = f"that start (rates there: {rates})" if rates else "that start"
    return f"No equilibrium of '{problem.name}' was found near {start}. Start nearer, or let a run settle first."
