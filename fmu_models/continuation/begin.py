"""The motion that a branch begins at: from a start near it, or where a run from there settles."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.continuation.problem.flow import FlowProblem
from fmu_models.continuation.problem.imported import ImportedProblem
from fmu_models.continuation.problem.map import MapProblem
from fmu_models.continuation.problem.node import Lost, Node, look, parameter, solved
from fmu_models.continuation.problem.pauses import held_at_start, pauses
from fmu_models.continuation.problem.problem import Problem, Vector
from fmu_models.sections.cycles import last_cycle
from fmu_models.sections.iteration import Iteration
from fmu_models.sections.strobe import Strobe
from fmu_models.sections.system import SectionSystem
from fmu_models.simulation.ensemble import EnsembleRuns
from fmu_models.simulation.run import simulate

SETTLE = 400  # periods of a run that settles to its motion
# a motion farther out than this goes to infinity, as the engine has it for runs over a section
FAR = EnsembleRuns.bound


def begin_of(
    system: SectionSystem, problem: Problem, between: tuple[float, float],
    start: Mapping[str, float] | Sequence[float] | None, settle: bool,
) -> Node:  # fmt: skip
    """The motion at the start."""
    value = problem.value_within(between)
    point = system.start(start)
    flow_problem = problem if isinstance(problem, FlowProblem) and not isinstance(problem, ImportedProblem) else None
    if settle and flow_problem is not None and flow_problem.autonomous:
        z = _last_cycle(flow_problem, point, value)
    else:
        problem, point = _placed(system, problem, flow_problem, point, value, settle)
        z = point[: len(problem.states)]
        if isinstance(problem, FlowProblem) and problem.autonomous:
            z = np.append(z, problem.strobe.period or 0.0)
        z = np.append(z, value)
    scales = problem.scales(z, between)
    node = _divided(problem, z, scales, between)
    try:
        node = node or solved(problem, scales, z / scales, parameter(value), reach=2.0)
    except Lost as error:
        raise StickslipError(
            f"No periodic motion of {system.name} was found near that start ({error}{_missed(problem, error, z)}). "
            f"Start nearer, let it settle first (settle=True, --settle), or {_doubt(problem)}."
        ) from None
    moved = node.problem.rephased(node.z, node.seen, node.scales)
    if moved is not None:
        with suppress(Lost):  # it stays where it was
            scales = moved[0].scales_like(node.scales)
            node = solved(moved[0], scales, moved[1] / scales, parameter(value), reach=0.1)
    return node


def _divided(problem: Problem, z: Vector, scales: Vector, between: tuple[float, float]) -> Node | None:
    """The motion near z in several segments, where tangents grow so much that one does not come to it; None where they
    do not, or there is none."""
    seen = look(problem, z)
    moved = None if seen is None else problem.rephased(z, seen, scales)
    if moved is None or moved[0].width == problem.width:
        return None
    segments, guess = moved

    def near(guess: Vector, scales: Vector) -> Node:
        return solved(segments, scales, guess / scales, parameter(float(z[-1])), reach=np.inf)

    try:
        z_found = near(guess, segments.scales_like(scales)).z
        return near(z_found, segments.scales_like(segments.scales(z_found, between)))  # in scales of its own
    except Lost:
        return None


def _placed(
    system: SectionSystem, problem: Problem, flow_problem: FlowProblem | None, point: Vector, value: float, settle: bool
) -> tuple[Problem, Vector]:
    """The start, or where a run from it settles, and the problem at a phase where nothing holds; ``flow_problem`` is
    the problem, if it tells of events."""
    try:
        point = _settled(system, point) if settle else point
    except StickslipError as error:
        # what rests against a contact at the end of a period does not begin there
        if flow_problem is None:
            raise
        return _settled_free(flow_problem, point, value, error)
    if flow_problem is not None and (flow_problem.autonomous or point[len(flow_problem.states) :].any()):
        return _freed(flow_problem, point, value)
    return problem, point


def _missed(problem: Problem, error: Lost, z: Vector) -> str:
    """By how much the nearest motion that was tried misses its own start."""
    nearest = z if error.nearest is None else error.nearest
    try:
        seen = problem.see(nearest)
    except StickslipError as refused:
        return f": {refused}"
    at = ", ".join(f"{name} = {value:.6g}" for name, value in zip(problem.states, nearest.tolist(), strict=False))
    return f"; the nearest, from {at}, misses its start by {np.abs(seen.residual).max():.2g} after one period"


def _doubt(problem: Problem) -> str:
    """What else may be wrong."""
    if not isinstance(problem, FlowProblem):
        return "check how many steps it takes"
    if problem.autonomous:
        return f"check its period, about {problem.strobe.period:g} s (period=, --period)"
    often = "check how many periods of the forcing it takes (every=, --every)"
    unforced = ", or that something forces it: else say so (autonomous=True, --autonomous)"
    return often + (unforced if problem.strobe.period is not None else "")


def _settled(system: SectionSystem, point: Vector) -> Vector:
    """Where a run from a point has come to, after many steps."""
    for _ in range(SETTLE):
        made_step = system.step(point[None], derivative=False)
        if made_step.why:
            why = next(iter(made_step.why.values()))
            raise StickslipError(f"The start does not settle: {why}. Start elsewhere, or choose other values.")
        point = made_step.points[0]
    return point


def _freed(problem: FlowProblem, point: Vector, value: float) -> tuple[FlowProblem, Vector]:
    """The problem at a phase where nothing holds, sticks or remembers, and the state there of a motion that begins
    where something does."""
    strobe = problem.strobe.at(**{problem.over: value})
    length = strobe.every * float(strobe.periods({}, 1)[0])
    events = strobe.trajectory(point, np.array([length])).events
    if not held_at_start(events):
        return problem, point
    holding, pause_start, pause = pauses(events, length)[0]
    if holding and point[len(problem.states) :].any():
        raise StickslipError(
            f"The motion of '{strobe.name}' near that start is never free of a stop that remembers its speed of entry: "
            "start where it is."
        )
    middle = (pause_start + pause / 2) % length
    moved = strobe.trajectory(point, np.array([middle]))
    phase = problem.phase if problem.autonomous else middle / length * strobe.every
    return replace(problem, phase=phase), np.array([float(moved[name][0]) for name in problem.states])


def _settled_free(
    problem: FlowProblem, start: Vector, value: float, failure: StickslipError
) -> tuple[FlowProblem, Vector]:
    """The same of one long run, at a phase where nothing holds or sticks. StickslipError: the failure of a run period
    by period, where no contact is what stopped it."""
    strobe = problem.strobe.at(**{problem.over: value})
    length = strobe.every * float(strobe.periods({}, 1)[0])
    late = SETTLE * length
    events = [
        replace(event, time=event.time - late)
        for event in strobe.trajectory(start, np.array([late + length])).events
        if event.time > late
    ]
    if not events:
        raise failure
    _, pause_start, pause = pauses(events, length)[0]
    middle = (pause_start + pause / 2) % length
    moved = strobe.trajectory(start, np.array([late + middle]))
    point = np.array([float(moved[name][0]) for name in problem.states])
    if not (np.abs(point) < FAR).all():
        raise failure
    return replace(problem, phase=middle / length * strobe.every), point


def _last_cycle(problem: FlowProblem, point: Vector, value: float) -> Vector:
    """z of the cycle that a run from a point ends in, in the middle of its longest pause between events, free of held
    contacts if there is one."""
    strobe = problem.strobe.at(**{problem.over: value})
    run: dict[str, Any] = {name: argument for name, argument in strobe.as_run(point).items() if name != "start_time"}
    cycle = last_cycle(strobe.fmu, SETTLE * float(strobe.period or 0.0), **run)
    if cycle is None:
        raise StickslipError(
            f"'{strobe.name}' does not settle to a cycle with events in {SETTLE} times {strobe.period:g} s. Start on "
            "the cycle, or choose other values."
        )
    _, pause_start, pause = pauses(cycle.events, cycle.period)[0]
    middle = pause_start + pause / 2
    moved = simulate(strobe.fmu, middle, output_times=[middle], **run)
    return np.array([*(float(moved[name][0]) for name in problem.states), cycle.period, value])


def problem_of(system: SectionSystem, over: str) -> Problem:
    """The family that a section describes. StickslipError: another section than a strobe or a map."""
    if isinstance(system, Iteration):
        return MapProblem(system, over)
    if not isinstance(system, Strobe):
        raise StickslipError(
            f"A branch of '{system.name}' is followed at a strobe: name what forces it, or say that nothing does and "
            "give about how long its period is (autonomous=True, period=)."
        )
    system.fmu.refuse_cones("branches")
    return FlowProblem(system, over) if system.fmu.ours else ImportedProblem(system, over)
