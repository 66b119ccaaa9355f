"""The logs that commands take, and how they are read."""

from __future__ import annotations

from collections.abc import Sequence
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


def repairs(text: str | None) -> list[str]:
    """Names between commas."""
    return [name.strip() for name in (text or "").split(",") if name.strip()]


def read_logs(
    paths: Sequence[Path], constants: dict[str, float], repair: str | None = None, reader: str | None = None
) -> list[RigLog]:
    """Logs from files and folders; ``constants`` of the rig replace those stated with the logs.

    repair: names of `rig_io.logs.log.read_log` between commas. What was mended is said on standard error.
    reader: of the user, for his own kind of logs.

    Raises:
        StickslipError: as in `rig_io.logs.log.read_log`, or an unknown constant.
    """
    from dataclasses import replace

    from rig_io.logs.log import RIG_UNITS, Quantity, RigConstants
    from rig_io.packages.datapackage import read_log, read_package

    for name in constants:
        if name not in (*RIG_UNITS, "N"):
            known = ", ".join((*RIG_UNITS, "N"))
            raise StickslipError(f"The rig has no constant '{name}'. Known are: {known} (N: of each driving disc).")
    # tables of one driving disc call its normal force N
    forces = dict.fromkeys(("N0", "N1"), constants["N"]) if "N" in constants else {}
    stated = {**forces, **{name: value for name, value in constants.items() if name != "N"}}
    given = {name: Quantity(value, RIG_UNITS[name], 0.0) for name, value in stated.items()}
    mend = repairs(repair)
    logs: list[RigLog] = []
    with console.warnings_said():
        for path in paths:
            if path.is_dir() or path.suffix == ".json":
                logs += read_package(path, repair=mend, reader=reader)
            elif given and not (path.parent / "datapackage.json").exists():
                logs.append(read_log(path, rig=RigConstants(**given), repair=mend, reader=reader))
            else:
                logs.append(read_log(path, repair=mend, reader=reader))
    return [replace(log, rig=replace(log.rig, **given)) for log in logs] if given else logs
