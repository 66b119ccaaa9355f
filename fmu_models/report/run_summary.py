"""What a run did, in words and numbers: ranges, events, impacts, and how far it can be trusted."""

from __future__ import annotations

import dataclasses
import itertools
from typing import TYPE_CHECKING, Any

from fmu_models.console import table
from fmu_models.simulation.accuracy import COMPANIONS
from fmu_models.simulation.trajectory import CONTACT_STATES, RIGID_STATES

if TYPE_CHECKING:
    from rich.console import Console

    from fmu_models.simulation.accuracy import ErrorEstimate
    from fmu_models.simulation.fmu import Fmu
    from fmu_models.simulation.trajectory import Trajectory


def summary(fmu: Fmu, trajectory: Trajectory, until: float, estimate: ErrorEstimate | None = None) -> dict[str, Any]:
    """What happened: ranges, ends, events per contact, share of the run in each contact state, impacts; error and time.

    until: s, end of the run, which begins at 0.
    """
    ranges = {
        name: {
            "unit": trajectory.units[name],
            "min": float(trajectory[name].min()),
            "max": float(trajectory[name].max()),
            "end": float(trajectory[name][-1]),
        }
        for name in (*fmu.states, *fmu.outputs)
    }
    contacts = {}
    rigid = fmu.impacts
    for name in fmu.contacts:
        names = RIGID_STATES if name in rigid else CONTACT_STATES
        events = [event for event in trajectory.events if event.contact == name]
        first = events[0].before if events else int(trajectory[f"{name}_state"][0])
        changes = [(0.0, first), *((event.time, event.after) for event in events), (until, first)]
        shares: dict[str, float] = {}
        for (begin, state), (end, _) in itertools.pairwise(changes):
            shares[names[state]] = shares.get(names[state], 0.0) + (end - begin) / until
        contacts[name] = {"events": len(events), "shares": shares}
    content: dict[str, Any] = {
        "model": fmu.description.modelName,
        "until": until,
        "ranges": ranges,
        "contacts": contacts,
        "steps": trajectory.steps,
        "seconds": trajectory.seconds,
    }
    if estimate:
        content["error"] = dataclasses.asdict(estimate) | {"companions": COMPANIONS}
    if rigid:
        gains = [event.work for event in trajectory.gains]
        content["impacts"] = {
            "count": len(trajectory.impacts),
            "work": sum(event.work for event in trajectory.impacts),
            "raised_energy": len(gains),
            "raised_by": sum(gains),
            "largest_raise": max(gains, default=0.0),
        }
    return content


def print_summary(content: dict[str, Any], out: Console) -> None:
    """The same for people; ``files`` in it are those written."""
    out.print(f"[bold]{content['model']}[/bold] to t = {content['until']:g} s in {content['steps']} steps")
    made = table("quantity", ">min", ">max", ">at the end", "unit")
    for name, row in content["ranges"].items():
        made.add_row(name, *(f"{row[key]:.6g}" for key in ("min", "max", "end")), row["unit"])
    out.print(made)
    for name, row in content["contacts"].items():
        shares = ", ".join(f"{state} {share:.1%}" for state, share in row["shares"].items() if share > 0)
        out.print(f"contact {name}: {row['events']} events; of the time {shares}")
    if "impacts" in content:
        _print_impacts(content["impacts"], out)
    if "error" in content:
        _print_error(content, out)
    for path in content["files"]:
        out.print(f"written: {path}")


def _print_impacts(impacts: dict[str, Any], out: Console) -> None:
    out.print(f"{impacts['count']} impacts; work of their impulses {impacts['work']:.6g} J")
    if impacts["raised_energy"]:
        out.print(
            f"{impacts['raised_energy']} of {impacts['count']} impacts raised the energy (largest "
            f"{impacts['largest_raise']:.2g} J): Newton's restitution with friction can do that; Poisson's cannot"
        )


def _print_error(content: dict[str, Any], out: Console) -> None:
    error, units = content["error"], {name: row["unit"] for name, row in content["ranges"].items()}
    own, others = error["seconds"]
    states = ", ".join(f"{name} {value:.1e} {units[name]}" for name, value in error["states"].items())
    out.print(
        f"[bold]error estimate {error['relative']:.1e}[/bold] of the largest value ({states}; events "
        f"{error['event_time']:.1e} s); [bold]run time {own * 1e3:.3g} ms[/bold], "
        f"and {others * 1e3:.3g} ms for the estimate"
    )
    out.print(
        "  the largest difference to the same run at a tenth and a hundredth of the tolerance, and with all start\n"
        "  values, parameters and constant inputs moved by one rounding either way; most by: "
        f"{error['by']}. No bound."
    )
    if error["apart"] is not None:
        out.print(
            f"  From t = {error['apart']:.6g} s on these are different motions (chaos, or a grazing contact):\n"
            "  the states after it mean nothing one by one, the estimate is of what comes before."
        )
    for name, reason in error["refused"].items():
        out.print(f"  left out: {name}, which cannot be run: {reason}", markup=False)
