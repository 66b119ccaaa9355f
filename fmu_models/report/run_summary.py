"""What happened in a run: ranges, ends, events, and the share of the run that contacts spent in their states."""

from __future__ import annotations

import dataclasses
import itertools
from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base import console
from fmu_models.base.record import record
from fmu_models.base.table import Cell, number, table
from fmu_models.fmu.elements import owner
from fmu_models.importer.experiment import NATIVE
from fmu_models.importer.texts import shown
from fmu_models.language.contact_kinds import CONTACT_STATES, RIGID_STATES
from fmu_models.report import beside_summary
from fmu_models.simulation.trajectory import Event

if TYPE_CHECKING:
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.importer.second_run import SecondRun
    from fmu_models.simulation.accuracy import ErrorEstimate
    from fmu_models.simulation.results import Recording
    from fmu_models.simulation.trajectory import ForeignEvent, Trajectory

LISTED = 40  # rows that a person reads; programs get all


def summary(
    fmu: Fmu, recording: Recording, estimate: ErrorEstimate | None = None, second: SecondRun | None = None
) -> dict[str, Any]:
    """What happened, as plain data, ready for JSON; a number that is not finite is null."""
    trajectory = recording.trajectory
    rates = {str(u.variable.name) for u in fmu.description.derivatives if u.variable}
    ours, unshown = (*fmu.states, *fmu.outputs), {*rates, *fmu.inputs}
    listed = [n for n in trajectory.values if (n in ours if fmu.ours else owner(n, fmu.variables) not in unshown)]
    # the engine inside our FMUs tells of contacts, the master of event indicators
    contacts = fmu.contacts if fmu.ours and not trajectory.method else []
    content = {
        "model": fmu.description.modelName,
        "until": float(trajectory.time[-1]) if trajectory.time.size else None,
        "method": trajectory.method or NATIVE,
        "ranges": {name: _range(trajectory, name) for name in listed},
        "not_finite": _not_finite(trajectory),
        "contacts": {name: _contact(trajectory, name, rigid=name in fmu.impacts) for name in contacts},
        "events": dict(Counter(_kind(event) for event in trajectory.events)),
        "clocks": _clocks(fmu, trajectory),
        "steps": trajectory.steps,
        "seconds": trajectory.seconds,
    }
    if trajectory.texts:
        content["texts"] = {
            name: dict(zip(("start", "end"), map(shown, ends), strict=True)) for name, ends in trajectory.texts.items()
        }
    if estimate:
        content["error"] = dataclasses.asdict(estimate) | {"companions": estimate.companions}
    if second:
        content["second_run"] = dataclasses.asdict(second) | {"agrees": second.agrees, "lasts": second.lasts}
        for row in content["second_run"]["variables"]:
            row["most"] = record(row["most"])
    if contacts and fmu.impacts:
        content["impacts"] = _impacts(trajectory)
    return content


def _impacts(trajectory: Trajectory) -> dict[str, Any]:
    """How many there were, the work of their impulses, and what raised the energy."""
    gains = [event.work for event in trajectory.gains]
    return {
        "count": len(trajectory.impacts),
        "work": sum(event.work for event in trajectory.impacts),
        "raised_energy": len(gains),
        "raised_by": sum(gains),
        "largest_raise": max(gains, default=0.0),
    }


def _range(trajectory: Trajectory, name: str) -> dict[str, Any]:
    data = np.asarray(trajectory[name], dtype=float)
    extremes = {"min": data.min(), "max": data.max(), "end": data[-1]}
    return {"unit": trajectory.units[name], **record(extremes)}


def _kind(event: Event | ForeignEvent) -> str:
    """The kind under which an event is counted."""
    if isinstance(event, Event):
        return f"contact {event.contact}"
    label = f" {event.name or event.indicator}" if event.indicator >= 0 else ""
    return f"{event.kind}{label}"


def _clocks(fmu: Fmu, trajectory: Trajectory) -> dict[str, int]:
    """How often each clock of the FMU ticked."""
    ticks: Counter[str] = Counter()
    for event in trajectory.events if fmu.clocks else ():
        ticks.update([f"{event.contact}.{event.clock}"] if isinstance(event, Event) else event.clocks.split(", "))
    return {name: ticks[name] for name in fmu.clocks}


def _not_finite(trajectory: Trajectory) -> dict[str, float]:
    """When variables first were no finite number; states never are, but what an FMU gives out may be."""
    rows = {}
    for name, data in trajectory.values.items():
        bad = np.flatnonzero(~np.isfinite(np.asarray(data, dtype=float)))
        if bad.size:
            rows[name] = float(trajectory.time[bad[0]])
    return rows


def _contact(trajectory: Trajectory, name: str, *, rigid: bool) -> dict[str, Any]:
    names = RIGID_STATES if rigid else CONTACT_STATES
    start, end = float(trajectory.time[0]), float(trajectory.time[-1])
    events = [event for event in trajectory.events if event.contact == name]
    first = events[0].before if events else int(trajectory[f"{name}_state"][0])
    changes = [(start, first), *((event.time, event.after) for event in events), (end, first)]
    shares: Counter[str] = Counter()
    for (since, state), (until, _) in itertools.pairwise(changes):
        shares[names[state]] += (until - since) / (end - start)  # type: ignore[assignment]
    return {"events": len(events), "shares": dict(shares)}


def print_summary(content: dict[str, Any], out: console.Console) -> None:
    """Print the summary for people."""
    plain = console.plain
    head = f" to t = {content['until']:g} s in {content['steps']} steps, method {content['method']}"
    out.print(plain(content["model"] or "", "bold"), plain(head), sep="")
    rows = [
        [name, *(_number(row[key]) for key in ("min", "max", "end")), row["unit"]]
        for name, row in list(content["ranges"].items())[:LISTED]
    ]
    out.print(table("", ("quantity", "min", "max", "at the end", "unit"), rows))
    print_unlisted(len(content["ranges"]) - LISTED, out)
    for name, row in content["contacts"].items():
        shares = ", ".join(f"{state} {share:.1%}" for state, share in row["shares"].items() if share > 0)
        out.print(f"contact {name}: {row['events']} events; of the time {shares}", markup=False)
    if content["clocks"]:
        out.print(plain(f"clocks: {', '.join(f'{name} {count}' for name, count in content['clocks'].items())} ticks"))
    for name, row in content.get("texts", {}).items():
        change = "" if row["start"] == row["end"] else f", at the end '{row['end']}'"
        out.print(plain(f"{name}: '{row['start']}'{change}"))
    if "impacts" in content:
        _print_impacts(content["impacts"], out)
    if "error" in content:
        _print_error(content, out)
    if not content["contacts"]:
        counts = sorted(content["events"].items(), key=lambda item: -item[1])
        listed = ", ".join(f"{kind}: {count}" for kind, count in counts[:LISTED])
        out.print(plain(f"{sum(content['events'].values())} events{f' ({listed})' if listed else ''}"))
    if "second_run" in content:
        _print_second(content["second_run"], out)
    if "beside" in content:
        beside_summary.print_summary(content["beside"], out)
    console.print_files(content["files"], out)


def _number(value: float | None) -> Cell:
    return Cell("not finite", "number") if value is None else number(value, ".6g")


def _print_impacts(impacts: dict[str, Any], out: console.Console) -> None:
    out.print(f"{impacts['count']} impacts; work of their impulses {impacts['work']:.6g} J")
    if impacts["raised_energy"]:
        out.print(
            f"{impacts['raised_energy']} of {impacts['count']} impacts raised the energy (largest "
            f"{impacts['largest_raise']:.2g} J): Newton's restitution with friction can do that; Poisson's cannot"
        )


def _print_second(second: dict[str, Any], out: console.Console) -> None:
    plain = console.plain
    head = f"second run, steps of at most {second['max_step']:.4g} s"
    if second["agrees"]:
        out.print(
            plain(f"{head}: it shows the same. What lasts less than {second['lasts']:.2g} s may be missed still.")
        )
        return
    out.print(plain(f"{head}: it differs. A pulse that one run missed, or a motion too sensitive to be told."))
    if second["failure"]:
        out.print(plain(f"  it could not be made: {second['failure']}"))
    for event in second["events"][:LISTED]:
        label = f" {event['indicator']}" if event["indicator"] >= 0 else ""
        out.print(
            plain(f"  {event['kind']} event{label} at t = {event['time']:.9g} s, in the {event['run']} run alone")
        )
    for row in second["variables"][:LISTED]:
        deviation = "not finite in one of them" if row["most"] is None else f"at most {row['most']:.6g}"
        out.print(plain(f"  {row['variable']} differs from t = {row['time']:.9g} s on: {deviation}"))
    print_unlisted(sum(max(0, len(second[name]) - LISTED) for name in ("events", "variables")), out)


def print_unlisted(count: int, out: console.Console) -> None:
    """Say how many rows are left out, if any are."""
    if count > 0:
        out.print(console.plain(f"  and {count} more, which --json lists"))


def _print_error(content: dict[str, Any], out: console.Console) -> None:
    error, units = content["error"], {name: row["unit"] for name, row in content["ranges"].items()}
    seconds, others = error["seconds"]
    states = ", ".join(f"{name} {value:.1e} {units[name]}" for name, value in error["states"].items())
    out.print(
        f"[bold]error estimate {error['relative']:.1e}[/bold] of the largest value ({states}; events "
        f"{error['event_time']:.1e} s); [bold]run time {seconds * 1e3:.3g} ms[/bold], "
        f"and {others * 1e3:.3g} ms for the estimate"
    )
    defects = ", ".join(f"{name} {value:.1e} {units[name]}" for name, value in error["defect"].items())
    out.print(f"  defect, by evaluation at single points between the events: {defects}")
    out.print(
        "  the largest difference to the same run with steps that end elsewhere, at a tenth of the tolerance, and\n"
        "  with all start values, parameters and constant inputs moved by one rounding either way; most by: "
        f"{error['by']}. No bound."
    )
    if error["wrong"] is not None:
        verdict = f"'{error['contradiction']}' contradicts its contact" if error["contradiction"] else "by its defect"
        out.print(
            f"  [bold]Wrong from t = {error['wrong']:.6g} s on[/bold] ({verdict}): a step went past something narrow.\n"
            "  Start the run anew at times between, and tell us of the model."
        )
    if error["apart"] is not None:
        out.print(
            f"  From t = {error['apart']:.6g} s on these are different motions (chaos, or a grazing contact):\n"
            "  the states after it mean nothing one by one, the estimate is of what comes before."
        )
    for name, reason in error["refused"].items():
        out.print(f"  left out: {name}, which cannot be run: {reason}", markup=False)
