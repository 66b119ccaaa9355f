"""What a run of a coupled system came to, for people and for programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base import console
from fmu_models.base.table import number, table
from fmu_models.report import beside_summary

if TYPE_CHECKING:
    from fmu_models.coupling.system import CoupledSystem
    from fmu_models.simulation.results import Recording

SHOWN_EVENTS = 10


def summary(system: CoupledSystem, recording: Recording) -> dict[str, Any]:
    """Units, connections, method, range and end of every variable, events."""
    trajectory = recording.trajectory
    ends = {
        name: {
            "unit": trajectory.units[name],
            "least": float(np.min(values)),
            "most": float(np.max(values)),
            "last": float(values[-1]),
        }
        for name, values in trajectory.values.items()
        if values.size
    }
    return {
        "system": system.name,
        "units": {name: unit.fmu.path.name for name, unit in system.units.items()},
        "connections": [
            {"from": ".".join(wire.source), "to": ".".join(wire.target), "factor": wire.factor, "offset": wire.offset}
            for wire in system.wires
        ],
        "method": trajectory.method,
        "end_time": float(trajectory.time[-1]) if trajectory.time.size else None,
        "steps": trajectory.steps,
        "variables": ends,
        "n_events": len(trajectory.events),
        "events": [{"time": event.time, "text": str(event)} for event in trajectory.events],
    }


def print_summary(content: dict[str, Any], out: console.Console) -> None:
    """The summary as a table."""
    units = ", ".join(f"{name} ({file})" for name, file in content["units"].items())
    out.print(console.plain(f"{content['system']}: {units}"))
    for wire in content["connections"]:
        if (wire["factor"], wire["offset"]) != (1.0, 0.0):
            shift = f" + {wire['offset']:g}" if wire["offset"] else ""
            out.print(console.plain(f"  {wire['to']} = {wire['factor']:g} {wire['from']}{shift}"))
    out.print(console.plain(f"{content['method']}: {content['steps']} steps to t = {content['end_time']:.9g} s"))
    ends = ("least", "most", "last")
    rows = (
        [name, row["unit"], *(number(row[key], ".9g") for key in ends)] for name, row in content["variables"].items()
    )
    out.print(table("", ("variable", "unit", *ends), rows))
    if content["n_events"]:
        out.print(console.plain(f"{content['n_events']} events, the last of them:"))
        for event in content["events"][-SHOWN_EVENTS:]:
            out.print(console.plain(f"  {event['text']}"))
    if "beside" in content:
        beside_summary.print_summary(content["beside"], out)
    console.print_files(content["files"], out)
