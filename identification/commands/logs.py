"""The logs that commands take, and how they are read."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError

if TYPE_CHECKING:
    from rig_io.logs.log import RigLog

Logs = Annotated[
    list[Path], typer.Argument(metavar="LOGS...", help="Logs, or the folder of a data package with its logs.")
]
Repairs = Annotated[
    str | None,
    typer.Option("--repair", metavar="NAME,...", help="Mend logs: sort (rows by time), duplicates (keep the first)."),
]
ReaderOption = Annotated[
    str | None, typer.Option("--reader", metavar="FILE", help="Reader for a kind of logs of your own: my_reader.py.")
]

Uncertainties = Annotated[
    list[str] | None,
    typer.Option(
        "--uncertainty",
        metavar="NAME=SD",
        help="Standard uncertainty of a rig constant, in its unit or in per cent: J=0.5%; of the laser's gain: "
        "laser=0.2%; of drive speeds that are not recorded: w=0.5%; repeat.",
    ),
]

SPEED, LASER = "w", "laser"  # what may be said beside constants of the rig


@dataclass(frozen=True)
class Stated:
    """What the command line says of rig constants: values, and standard uncertainties, of which ``relative`` are shares
    of the value."""

    values: Mapping[str, float] = field(default_factory=dict)
    deviations: Mapping[str, float] = field(default_factory=dict)
    relative: frozenset[str] = frozenset()

    def without(self, names: Collection[str]) -> Stated:
        """What is said of the others."""
        values, deviations = (
            {name: number for name, number in said.items() if name not in names}
            for said in (self.values, self.deviations)
        )
        return Stated(values, deviations, self.relative)

    def deviation(self, name: str, value: float) -> float | None:
        """Of a constant of this value, in its unit; None where nothing is said."""
        if name not in self.deviations:
            return None
        return self.deviations[name] * (value if name in self.relative else 1.0)


def stated(settings: Sequence[str] | None, uncertainties: Sequence[str] | None = None) -> Stated:
    """Values and uncertainties from ``--set NAME=VALUE``, ``NAME=VALUE±SD`` (or +-) and ``--uncertainty NAME=SD``.
    StickslipError: not of that form, an uncertainty that is not positive, or a name twice."""
    parts = [re.split(r"±|\+-|\+/-", text, maxsplit=1) for text in settings or ()]
    values = console.assignments([part[0] for part in parts], "rig constant")
    beside = [f"{part[0].partition('=')[0]}={part[1]}" for part in parts if len(part) > 1]
    said = [*beside, *(uncertainties or ())]
    relative = frozenset(text.partition("=")[0].strip() for text in said if text.strip().endswith("%"))
    numbers = console.assignments([text.strip().removesuffix("%") for text in said], "uncertainty of a rig constant")
    for name, number in numbers.items():
        if not 0 < number < float("inf"):
            raise StickslipError(
                f"The uncertainty of {name} is {number:g}; it must be positive. Say what you would bet on: J=0.5%."
            )
    return Stated(values, {name: n * (0.01 if name in relative else 1.0) for name, n in numbers.items()}, relative)


def read_logs(
    paths: Sequence[Path], said: Stated, repair: str | None = None, reader: str | None = None
) -> list[RigLog]:
    """Logs from files and folders; constants of the rig that are ``said`` replace those stated with the logs.

    repair: names of `rig_io.logs.log.read_log` between commas. What was mended is said on standard error.
    reader: of the user, for his own kind of logs.

    Raises:
        StickslipError: as in `rig_io.logs.log.read_log`, an unknown constant, or an uncertainty of one without value.
    """
    from rig_io.logs.log import RIG_UNITS, RigConstants, StatedQuantity
    from rig_io.packages.datapackage import read_log, read_package

    beside = Stated(
        {name: value for name, value in said.values.items() if name == SPEED},
        {name: value for name, value in said.deviations.items() if name in (SPEED, LASER)},
        said.relative,
    )
    said = said.without((SPEED,) if LASER in said.values else (SPEED, LASER))
    for name in (*said.values, *said.deviations):
        if name not in (*RIG_UNITS, "N"):
            known = ", ".join((*RIG_UNITS, "N"))
            raise StickslipError(
                f"The rig has no constant '{name}'. Known are: {known} (N: of each driving disc), {SPEED} (speed of a "
                f"drive that is not recorded); and the uncertainty of {LASER} (its gain)."
            )
    stated = {
        name: StatedQuantity(value, RIG_UNITS[name], said.deviation(deviation, value))
        for deviation, value in said.values.items()
        for name in _entries(deviation)
    }
    mend = console.names_of(repair)
    logs: list[RigLog] = []
    with console.warnings_said():
        for path in paths:
            if path.is_dir() or path.suffix == ".json":
                logs += read_package(path, repair=mend, reader=reader)
            elif stated and not (path.parent / "datapackage.json").exists():
                logs.append(read_log(path, rig=RigConstants(**stated), repair=mend, reader=reader))
            else:
                logs.append(read_log(path, repair=mend, reader=reader))
    logs = [replace(log, rig=replace(log.rig, **stated)) for log in logs] if stated else logs
    for deviation in said.deviations:
        logs = [_with_deviation(log, deviation, said) for log in logs]
    return _with_laser(_with_speed(logs, beside), beside)


def _with_speed(logs: Sequence[RigLog], said: Stated) -> list[RigLog]:
    """Logs with what is said of drive speeds that they do not record, rad/s."""
    from identification.measurement.disc_motion import nominal_drives

    if SPEED not in said.values and SPEED not in said.deviations:
        return list(logs)
    nominal = [log for log in logs if nominal_drives(log)]
    if not nominal:
        raise StickslipError("All logs record how their drives turned, so that a nominal speed says nothing of them.")
    value = said.values.get(SPEED)
    if value is not None and len(nominal) > 1:
        raise StickslipError(
            f"One speed is said, {value:g} rad/s, and {len(nominal)} logs do not record theirs. State it for each log: "
            "stickslip describe FILES --set w:FILE=VALUE."
        )
    made = []
    for log in logs:
        done = log.experiment
        if nominal_drives(log):
            speeds = done.drive_speed if value is None else (value,) * len(log.contacts)
            known = [said.deviation(SPEED, abs(speed)) for speed in speeds]
            sure = done.drive_speed_uncertainty if value is None else ()
            stated = tuple(one for one in known if one is not None) or sure
            log = replace(log, experiment=replace(done, drive_speed=speeds, drive_speed_uncertainty=stated))
        made.append(log)
    return made


def _with_laser(logs: Sequence[RigLog], said: Stated) -> list[RigLog]:
    """Logs with what is said of the gain of their laser."""
    if LASER not in said.deviations:
        return list(logs)
    if not any(log.calibration.laser for log in logs):
        raise StickslipError("No log has a laser, so that an uncertainty of its gain says nothing of them.")
    known = said.deviations[LASER]
    return [
        replace(log, calibration=replace(log.calibration, laser=replace(log.calibration.laser, gain_deviation=known)))
        if log.calibration.laser
        else log
        for log in logs
    ]


def _entries(name: str) -> tuple[str, ...]:
    """A constant as logs have it: tables of one driving disc call its normal force N."""
    return ("N0", "N1") if name == "N" else (name,)


def _with_deviation(log: RigLog, name: str, said: Stated) -> RigLog:
    present = {entry: getattr(log.rig, entry) for entry in _entries(name) if getattr(log.rig, entry) is not None}
    if not present:
        raise StickslipError(
            f"Log '{log.name}' states no {name}, so that an uncertainty of it says nothing. Give its value: --set "
            f"{name}=VALUE±SD."
        )
    moved = {
        entry: replace(one, standard_uncertainty=said.deviation(name, one.value)) for entry, one in present.items()
    }
    return replace(log, rig=replace(log.rig, **moved))
