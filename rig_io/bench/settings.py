"""Settings of a bench as texts: NAME=VALUE with a unit, and a log for each of several values between commas."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import Field, dataclass, field, fields
from itertools import product
from pathlib import Path
from typing import Any, TypeVar

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.unit_names import conversion_factor
from rig_io.packages.datapackage import check_target, write_folder
from rig_io.readers import csv_log

T = TypeVar("T")
_SIZE = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S*)")


def setting(
    default: Any, meaning: str, unit: str = "", *, least: float | None = None, words: Sequence[str] = ()
) -> Any:
    """A field of a bench. unit: of a number, "" for a text; least: of its values; words: of which a text is one."""
    return field(default=default, metadata={"meaning": meaning, "unit": unit, "least": least, "words": tuple(words)})


@dataclass(frozen=True)
class Recorded:
    """What a bench records. columns: (n,) by name, in ``units``; truth: what nobody tells who reads the log."""

    name: str
    columns: Mapping[str, Any]
    units: Mapping[str, str]
    truth: Mapping[str, Any]


def sized(text: str, unit: str) -> float:
    """A number with or without a unit (then SI), in ``unit``. ValueError: none, or a unit that does not fit."""
    match = _SIZE.fullmatch(text.strip())
    if match is None:
        raise ValueError("it is no number with a unit")
    return float(match[1]) * (conversion_factor(match[2], unit) if match[2] else 1.0)


def check_settings(bench: Any) -> None:
    """Raises StickslipError: a number below its least value, or a word that is none."""
    for entry in fields(bench):
        value, least, words = getattr(bench, entry.name), entry.metadata["least"], entry.metadata["words"]
        if words and value not in words:
            raise StickslipError(f"'{entry.name}' is one of {', '.join(words)}; found '{value}'.")
        if least is not None and not value >= least:
            raise StickslipError(f"'{entry.name}' is at least {least:g} {entry.metadata['unit']}; found {value:g}.")


def benches(kind: type[T], texts: Sequence[str]) -> list[tuple[T, tuple[str, ...]]]:
    """Benches from texts such as "amplitude=1mm,5mm", one for each combination, and the names of what varies.
    StickslipError: no setting of that name, a value that is none, or given twice."""
    known: dict[str, Field[Any]] = {entry.name: entry for entry in fields(kind)}  # type: ignore[arg-type]
    values: dict[str, list[Any]] = {}
    for text in texts:
        name, _, said = (side.strip() for side in text.partition("="))
        refuse_unknown(name, known, f"There is no setting '{name}'. There are:\n{listed(kind)}\n")
        if name in values:
            raise StickslipError(f"The setting '{name}' is given twice. Give it once, several values between commas.")
        unit = known[name].metadata["unit"]
        try:
            values[name] = [sized(part, unit) for part in said.split(",")] if unit else [said]
        except ValueError as error:
            shown = unit.replace("1", "%") if unit == "1" else unit
            raise StickslipError(
                f"The setting '{name}' is not '{said}' ({error}). Its unit is {shown}, several values between commas."
            ) from error
    varied = tuple(name for name, some in values.items() if len(some) > 1)
    return [(kind(**dict(zip(values, some, strict=True))), varied) for some in product(*values.values())]


def log_names(kind: str, asked: Sequence[tuple[Any, Sequence[str]]]) -> list[str]:
    """Names of logs that say what varies, as recorders do: loop_25mm0x25Hz."""
    names: list[str] = []
    for bench, varied in asked:
        told = ""
        for name in varied:
            unit = {entry.name: entry.metadata["unit"] for entry in fields(bench)}[name]
            scale, shown = (1e3, "mm") if unit == "m" else (1.0, unit if unit.isalpha() else "")
            told += f"{scale * getattr(bench, name):g}".replace(".", "x").replace("+", "") + shown
        stem = f"{kind}_{told}" if told else kind
        names.append(stem if stem not in names else f"{stem}_{len(names)}")
    return names


def listed(kind: type[Any]) -> str:
    """A line for each setting: name, default, unit, meaning."""
    lines = []
    for entry in fields(kind):
        told = f"{entry.default:g} {entry.metadata['unit']}" if entry.metadata["unit"] else entry.default
        lines.append(f"  {entry.name}={told}: {entry.metadata['meaning']}")
    return "\n".join(lines)


def write_recorded(
    folder: Path, made: Sequence[Recorded], *, title: str, bare: bool = False, overwrite: bool = False
) -> Path:
    """Write logs as CSV with units in their heads, or with bare names, and what nobody tells in the sidecar beside.
    StickslipError: as in `rig_io.packages.datapackage.write_package`."""
    check_target(folder, [log.name.lower() for log in made], overwrite)

    def fill(work: Path) -> dict[str, Any]:
        for log in made:
            heads = {name: name if bare else f"{name} [{log.units[name]}]" for name in log.columns}
            csv_log.write(work / f"{log.name}.csv", {heads[name]: column for name, column in log.columns.items()})
        resources = [
            {"name": log.name.lower(), "path": f"{log.name}.csv", "emulation": dict(log.truth)} for log in made
        ]
        return {"profile": "data-package", "name": work.name.lower(), "title": title, "resources": resources}

    return write_folder(folder, [f"{log.name}.csv" for log in made], fill)
