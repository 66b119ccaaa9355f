"""Declarations that nobody wrote, on every road, against an event-driven reference that shares no code (tests/oracle).

    simulate             states to ACCURATE of the reference, up to where nearby runs part
    simulate_with_error  its estimate covers the distance
    SensitiveRun         derivatives against central differences of runs
    lanes                where a model qualifies: the state of the series at the end
    outputs              derivatives extrapolate them
    importer, fmpy       Model Exchange and Co-Simulation of the first run

A failure is shrunk and printed as a file that runs alone. Refusals of motions that the reference follows are counted by
their causes.
"""

from __future__ import annotations

import random
import re
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from declared_source import source
from fmpy import simulate_fmu
from fuzzing import Target, WrongError
from oracle.declaration import Declaration, Values
from oracle.equations import Equations
from oracle.motion import GRAZES, Run, run
from oracle.random_declarations import declaration, pruned, values
from quick_export import quick_export
from test_output_derivatives import longest_pause, test_they_extrapolate_outputs

from fmu_models.base.errors import StickslipError
from fmu_models.families.jobs import Jobs
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.driver import Driver
from fmu_models.lanes.library import has_lanes
from fmu_models.language import contact_kinds
from fmu_models.sections.strobe import Strobe
from fmu_models.simulation.accuracy import simulate_with_error
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import SensitiveRun
from fmu_models.simulation.signal import Signal
from fmu_models.simulation.trajectory import Trajectory

RUNS = 5  # of a declaration
SHRINKS, SHRINKING = 60, 60.0  # declarations that are tried to make a failure smaller, for so many s at most
TIMES = 61
ACCURATE = 1e-7  # of the size of a motion; the reference has 1e-9 and better
NARROW = 0.1  # s: width of a pulse
AMPLIFIED = 100.0  # times what a nearby run of the reference parts
NUDGE = 1e-10
SEEN_BY_CVODE = 0.02  # s, its longest steps in 3 s are three times that
BESIDE = 1e-6  # s from an event: times that are left out
IMPORTED = 1e-4  # what an importer at its tolerance of 1e-9 is off by, its events late
PARTED = 1e-3
HELD = (contact_kinds.STICK, contact_kinds.CLOSED)  # stick, and a rigid contact at its wall


class Model:
    """A declaration on both sides."""

    def __init__(self, declared: Declaration, defaults: Mapping[str, float], folder: Path) -> None:
        self.declared, self.text = declared, source(declared, defaults)
        names: dict[str, Any] = {}
        exec(self.text, names)
        self.path = quick_export(names["MODEL"], folder / f"drawn_{len(list(folder.iterdir()))}.fmu")
        self.fmu = Fmu.open(self.path)
        self.equations = Equations(declared)
        self.states = [*declared.states, *declared.velocities]

    def ours(self, drawn: Values, times: Any = None) -> Trajectory:
        """The run of ``simulate``."""
        return simulate(self.fmu, drawn.end, output_times=grid(drawn) if times is None else times, **given(drawn))

    def reference(self, drawn: Values, rtol: float = 1e-11) -> Run:
        """That of the oracle."""
        return run(self.equations, drawn, grid(drawn), rtol=rtol)

    def columns(self, trajectory: Any) -> Any:
        """States of a run, (n_times, n_states)."""
        return np.array([trajectory[name] for name in self.states]).T


def grid(drawn: Values) -> Any:
    """Times that are compared."""
    return np.linspace(0.0, drawn.end, TIMES)


def given(drawn: Values) -> dict[str, Any]:
    """Values as our functions take them."""
    inputs = {name: Signal(*polygon) for name, polygon in drawn.inputs.items()}
    return {"parameters": dict(drawn.parameters), "start": dict(drawn.start), "inputs": inputs}


def cause(message: str) -> str:
    """Words of a refusal without its numbers and names."""
    message = re.sub(r"^.*?at t(ime)? ?=? ?[-\d.e+]+:?", "", message.removeprefix("drawn: "), count=1)
    message = re.sub(r"'[^']*'", "'*'", message)
    return re.sub(r"-?\d[\d.]*(e[-+]?\d+)?", "#", message).strip()[:110]


def apart(model: Model, drawn: Values, ours: Any, reference: Run, events: Iterator[float]) -> Any:
    """(n_times,) distance from the reference relative to the motion; zero where one of them knows nothing."""
    times = grid(drawn)
    at = np.array([*events, *(event[0] for event in reference.events), -1.0])
    known = np.isfinite(reference.states).all(axis=1) & (np.abs(times[:, None] - at).min(axis=1) > BESIDE)
    size = max(1.0, float(np.abs(reference.states[known]).max(initial=0.0)))
    return np.where(known, np.abs(ours - reference.states).max(axis=1), 0.0) / size


def parts(model: Model, drawn: Values, reference: Run) -> Any:
    """(n_times,) by how much runs of the reference part that begin next to each other, or are less accurate."""
    spread = np.zeros(TIMES)
    for side in (1.0, -1.0):
        start = {name: x + side * NUDGE for name, x in drawn.start.items()}
        other = run(model.equations, replace(drawn, start=start), grid(drawn), rtol=1e-9)
        at = np.array([*(event[0] for event in [*other.events, *reference.events]), -1.0])
        near = np.abs(grid(drawn)[:, None] - at).min(axis=1) <= BESIDE
        distance = np.abs(other.states - reference.states).max(axis=1)
        spread = np.maximum(spread, np.where(near, 0.0, np.nan_to_num(distance, nan=np.inf)))
    return np.maximum.accumulate(spread)


def judged(model: Model, drawn: Values, ours: Any, reference: Run, events: Any, allowed: float) -> str:
    """What is wrong with a run, in words; empty if nothing is."""
    error = apart(model, drawn, ours, reference, events)
    if error.max() <= allowed:
        return ""
    spread = AMPLIFIED * parts(model, drawn, reference) * max(1.0, allowed / ACCURATE)
    wrong = np.flatnonzero((error > allowed + spread) & (spread < PARTED))
    if not wrong.size:
        return ""
    return f"off by {error[wrong].max():.1e} of the motion, from t = {grid(drawn)[wrong[0]]:.4g} on"


def check(model: Model, drawn: Values, counts: Counter[str], whole: bool) -> tuple[str, str] | None:
    """A road on which a run is wrong, and how; by a reference that does not change with its tolerance."""
    found = _check(model, drawn, counts, whole, model.reference(drawn))
    return found and _check(model, drawn, Counter(), whole, model.reference(drawn, 1e-13))


def _check(model: Model, drawn: Values, counts: Counter[str], whole: bool, reference: Run) -> tuple[str, str] | None:
    counts["runs"] += 1
    if reference.reason:
        counts[f"reference ends: {reference.reason}"] += 1
    if reference.until <= 0.0:
        return None
    try:
        ours = model.ours(drawn)
    except StickslipError as error:
        reached = re.search(r"at t(?:ime)? ?=? ?([-\d.e+]*\d)", str(error))
        if reference.until > (float(reached[1]) if reached else 0.0) + BESIDE:
            counts[f"refused: {cause(str(error))}"] += 1
        return None
    events = [event.time for event in ours.events]
    if wrong := judged(model, drawn, model.columns(ours), reference, events, ACCURATE):
        _, estimate = simulate_with_error(model.fmu, drawn.end, output_times=grid(drawn), **given(drawn))
        return "simulate", f"{wrong}; simulate_with_error: {estimate.relative:.1e}"
    for name, road in ROADS.items():
        if name not in FIRST_ONLY or whole:
            counts[name] += 1
            try:
                if wrong := road(model, drawn, ours, reference):
                    return name, wrong
            except (StickslipError, RuntimeError) as error:
                if isinstance(error, RuntimeError) and "CVode" not in str(error):
                    raise
                counts[f"{name} refuses: {cause(str(error))}"] += 1
    return None


def _estimate(model: Model, drawn: Values, ours: Trajectory, reference: Run) -> str:
    run, estimate = simulate_with_error(model.fmu, drawn.end, output_times=grid(drawn), **given(drawn))
    if not np.array_equal(model.columns(run), model.columns(ours)):
        return "simulate_with_error gives another run than simulate"
    before = grid(drawn) < (estimate.apart or np.inf)
    error = np.where(before, apart(model, drawn, model.columns(ours), reference, (e.time for e in ours.events)), 0.0)
    allowed = 100.0 * estimate.relative + ACCURATE
    return f"off by {error.max():.1e}, the estimate says {estimate.relative:.1e}" if error.max() > allowed else ""


def _tangents(model: Model, drawn: Values, ours: Trajectory, reference: Run) -> str:
    """At the end, where no event is near, of a motion that rounding does not decide."""
    if reference.reason == GRAZES:
        return ""
    by = [*model.states, *list(drawn.parameters)[:6]]
    times = [drawn.end]
    with SensitiveRun(model.fmu, by=by, recorded=model.states) as sensitive:
        slopes = sensitive.run(times, **given(drawn))
    if slopes.one_sided or any(abs(event.time - drawn.end) < 1e-3 for event in ours.events):
        return ""
    sequence = [(event.contact, event.after) for event in ours.events]
    # what is decided at the start, on a boundary, differs from side to side and has no derivative
    base = model.columns(ours)[-1]
    for k, name in enumerate(by):
        estimates = []
        for step in (1e-5, 5e-6):
            ends = []
            for side in (1, -1):
                group = "start" if name in model.states else "parameters"
                moved = {**getattr(drawn, group), name: getattr(drawn, group)[name] + side * step}
                try:
                    there = model.ours(replace(drawn, **{group: moved}), times)
                except StickslipError:
                    break
                if [(event.contact, event.after) for event in there.events] != sequence:
                    break
                ends.append(model.columns(there)[-1])
            if len(ends) < 2:
                break
            if np.abs(ends[0] + ends[1] - 2 * base).max() <= 1e-3 * np.abs(ends[0] - ends[1]).max() + 1e-9:
                estimates.append((ends[0] - ends[1]) / (2 * step))
        if len(estimates) < 2:
            continue
        fine = (4 * estimates[1] - estimates[0]) / 3
        slack = 10 * np.abs(estimates[1] - estimates[0]).max() + 1e-6 * (1 + np.abs(fine).max())
        off = np.abs(slopes.derivative[-1][:, k] - fine).max()
        if off > slack:
            return f"d/d{name}: {slopes.derivative[-1][:, k]} instead of {fine}"
    return ""


def _lanes(model: Model, drawn: Values, ours: Trajectory, reference: Run) -> str:
    if drawn.inputs or not has_lanes(model.fmu):
        return ""
    system = Strobe(model.fmu, period=drawn.end, autonomous=True, parameters=dict(drawn.parameters))
    rows = system.run(Jobs(np.tile(system.start(dict(drawn.start)), (3, 1)), {}, rows=1), np.zeros(1, np.int32))
    names = list(system.states)
    end = np.array([rows.points[0, 0, names.index(name)] for name in model.states])
    if any(abs(event.time - drawn.end) < BESIDE for event in ours.events):
        return ""
    if any(
        f"{name}_state" in ours and ours[f"{name}_state"][-1] == contact_kinds.CLOSED for name in model.fmu.contacts
    ):
        return ""  # a strobe puts it on its wall as that is at the phase of the start: the end of these is no period
    off = np.abs(end - model.columns(ours)[-1]).max()
    return f"off by {off:.1e} from the series" if off > 1e-8 * max(1.0, np.abs(end).max()) else ""


def _importer(model: Model, drawn: Values, ours: Trajectory, reference: Run) -> str:
    with Driver(model.fmu, tolerance=1e-9) as driver:
        there = driver.run(drawn.end, output_times=grid(drawn), **given(drawn))
    events = [event.time for event in ours.events]
    return judged(model, drawn, model.columns(there), reference, events, IMPORTED)


def _fmpy(kind: str) -> Callable[..., str]:
    def road(model: Model, drawn: Values, ours: Trajectory, reference: Run) -> str:
        table: Any = None
        if drawn.inputs:
            table = _table(drawn)
        if kind == "ModelExchange" and (drawn.inputs or any(width < SEEN_BY_CVODE for _, width in drawn.features)):
            return ""  # within a step fmpy holds an input, and CVode's steps shrink to nothing; pulses it steps over
        result = simulate_fmu(
            str(model.path),
            fmi_type=kind,
            stop_time=drawn.end,
            relative_tolerance=1e-9,
            output_interval=drawn.end / (TIMES - 1),
            start_values={**drawn.parameters, **drawn.start},
            input=table,
            output=model.states,
        )
        # of an event there are two rows: the last of a time is after it
        last = np.searchsorted(result["time"], grid(drawn) + 1e-9, side="right") - 1
        if np.abs(result["time"][last] - grid(drawn)).max() > 1e-9:
            return f"it ends at {result['time'][-1]:.6g} s"
        there = np.array([result[name][last] for name in model.states]).T
        return judged(model, drawn, there, reference, [event.time for event in ours.events], IMPORTED)

    return road


def _extrapolated(model: Model, drawn: Values, ours: Trajectory, reference: Run) -> str:
    """Derivatives of outputs by Co-Simulation, in the longest pause of the motion from the declared start."""
    # the test looks at eight places of a step: a narrow pulse may lie between them
    widths = [abs(value) for name, value in drawn.parameters.items() if name.startswith("tw")]
    if not model.fmu.outputs or min(widths, default=1.0) < NARROW:
        return ""
    pause = longest_pause(model.fmu)
    states = simulate(model.fmu, pause[0], output_times=[pause[0]])
    held = sum(states[f"{name}_state"][-1] in HELD for name in model.fmu.contacts)
    if held > len(model.declared.states):
        return ""  # how the force is shared is no matter of the motion, and changes with the shares of each step
    try:
        test_they_extrapolate_outputs(model.fmu, pause)
    except AssertionError as error:
        return f"derivatives of outputs do not extrapolate them: {str(error).splitlines()[0] if str(error) else ''}"
    return ""


def _table(drawn: Values) -> Any:
    """Inputs and their rates as fmpy takes them: two rows at every bend."""
    (times, _), *_ = drawn.inputs.values()
    names = [column for name in drawn.inputs for column in (name, f"{name}_rate")]
    table = np.zeros(2 * len(times) - 2, dtype=[("time", "f8"), *((name, "f8") for name in names)])
    table["time"] = np.repeat(times, 2)[1:-1]
    for name, (at, heights) in drawn.inputs.items():
        table[name] = np.repeat(heights, 2)[1:-1]
        table[f"{name}_rate"] = np.repeat(np.diff(heights) / np.diff(at), 2)
    return table


ROADS: dict[str, Callable[..., str]] = {
    "estimate": _estimate,
    "tangents": _tangents,
    "lanes": _lanes,
    "importer": _importer,
    "fmpy ModelExchange": _fmpy("ModelExchange"),
    "fmpy CoSimulation": _fmpy("CoSimulation"),
    "derivatives of outputs": _extrapolated,
}
FIRST_ONLY = ("derivatives of outputs", "importer", "fmpy ModelExchange", "fmpy CoSimulation")


def simpler(declared: Declaration, drawn: Values) -> Iterator[tuple[Declaration, Values]]:
    """The same with something left out or made plain."""
    for k in range(len(declared.contacts)):
        contacts = [contact for i, contact in enumerate(declared.contacts) if i != k]
        yield replace(declared, contacts=contacts), drawn
    for k, contact in enumerate(declared.contacts):
        if contact.get("where"):
            plain = {**contact, "where": None}
            yield replace(declared, contacts=[plain if i == k else c for i, c in enumerate(declared.contacts)]), drawn
    for part in ("potential", "dissipation"):
        terms = getattr(declared, part).split(" + ")
        for k in range(len(terms) if terms != ["0"] else 0):
            yield replace(declared, **{part: " + ".join(terms[:k] + terms[k + 1 :]) or "0"}), drawn
    for q in declared.applied:
        yield replace(declared, applied={k: e for k, e in declared.applied.items() if k != q}), drawn
    for name, value in drawn.parameters.items():
        # shares ("r0") that were 1 would take levers and normal forces away
        for plain in (0.0,) if name.startswith("r") else (0.0, 1.0):
            if value not in (0.0, 1.0):
                yield declared, replace(drawn, parameters={**drawn.parameters, name: plain})


def shrunk(declared: Declaration, drawn: Values, road: str, folder: Path) -> tuple[Declaration, Values, str]:
    """A smaller failure on the same road."""
    message, tries, end = "", 0, time.monotonic() + SHRINKING
    again = True
    while again and tries < SHRINKS and time.monotonic() < end:
        again = False
        for smaller, fewer in simpler(declared, drawn):
            tries += 1
            if tries > SHRINKS or time.monotonic() > end:
                break
            smaller = pruned(smaller)
            kept = {name: fewer.parameters[name] for name in smaller.parameters}
            inputs = {name: fewer.inputs[name] for name in smaller.inputs}
            fewer = replace(fewer, parameters=kept, inputs=inputs)
            try:
                found = check(Model(smaller, kept, folder), fewer, Counter(), road in FIRST_ONLY)
            except Exception:
                continue
            if found and found[0] == road:
                declared, drawn, message, again = smaller, fewer, found[1], True
                break
    return declared, drawn, message


def minimal(declared: Declaration, drawn: Values) -> str:
    """The file of a failure: what runs, and what the reference says."""
    reference = run(Equations(declared), drawn, grid(drawn))
    last = int(np.flatnonzero(np.isfinite(reference.states).all(axis=1))[-1])
    expected = dict(zip([*declared.states, *declared.velocities], map(float, reference.states[last]), strict=True))
    inputs = ", ".join(f'"{name}": Signal({x[0]}, {x[1]})' for name, x in drawn.inputs.items())
    return (
        f"{source(declared, drawn.parameters)}\n"
        f"start = {dict(drawn.start)}\n"
        f"inputs = {{{inputs}}}\n"
        f"motion = simulate(load(MODEL), {drawn.end}, start=start, inputs=inputs, output_times=[{grid(drawn)[last]}])\n"
        f"expected = {expected}  # at {grid(drawn)[last]:.6g} s, by tests/oracle\n"
        "for name, value in expected.items():\n"
        "    print(name, motion[name][-1], value)\n"
    )


def _case(generator: random.Random, runs: int = RUNS) -> Counter[str]:
    folder = Path()
    declared, draw = declaration(generator)
    all_values = [values(declared, draw, generator) for _ in range(runs)]
    counts: Counter[str] = Counter(declarations=1)
    try:
        model = Model(declared, all_values[0].parameters, folder)
    except StickslipError as error:
        counts[f"declaration refused: {cause(str(error))}"] += 1
        return counts
    for k, drawn in enumerate(all_values):
        found = check(model, drawn, counts, whole=k == 0)
        if found:
            road, message = found
            small, fewer, now = shrunk(declared, drawn, road, folder)
            kinds = " ".join(sorted({contact["kind"] for contact in small.contacts}))
            raise WrongError(f"{road}: {kinds}", f"{now or message}\n{minimal(small, fewer)}")
    return counts


DECLARATIONS = Target("declarations", _case, weight=1)
