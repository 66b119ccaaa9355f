"""A system of several FMUs, read from a TOML file.

connections = [{ from = "rig.F0", to = "motor0.force" }, { from = "motor0.w", to = "rig.w0" }]
stop_time = 10.0

[units.rig]
fmu = "rig.fmu"                 # a path from this file on, or: model = "disc_rig", contacts = ["disc0"]
parameters = { N0 = 3.0 }
start = { theta = 0.1 }
"""

from __future__ import annotations

import math
import os
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fmu_models.base import shipped
from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.files import named_file
from fmu_models.codegen.package import built
from fmu_models.coupling import ssp
from fmu_models.coupling.system import CoupledSystem, Unit, opened
from fmu_models.coupling.wiring import Connection

KEYS = ("units", "connections", "solver", "step", "adaptive", "tolerance", "start_time", "stop_time", "outputs")
UNIT_KEYS = ("fmu", "model", "contacts", "parameters", "start", "inputs")
CONNECTION_KEYS = ("from", "to", "factor", "offset")


def read_system(path: str | os.PathLike[str]) -> CoupledSystem:
    """The system in a TOML, .ssd or .ssp file.

    Raises:
        StickslipError: no such file, not readable, or a system that does not fit together; says where.
    """
    path = named_file(path, shipped.files("systems"), "system")
    if path.suffix.lower() in (".ssp", ".ssd"):
        return ssp.read(path)
    try:
        content = tomllib.loads(path.read_text("utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise StickslipError(f"'{path}' is not TOML: {error}.") from error
    return _system(path, content)


def _system(path: Path, content: Mapping[str, Any]) -> CoupledSystem:
    _known(f"'{path}'", content, KEYS)
    tables = _typed(path, content, "units", dict, {})
    units = {name: _unit(path, name, table) for name, table in tables.items()}
    connections = [
        _connection(f"'{path}': connection {i + 1}", entry)
        for i, entry in enumerate(_typed(path, content, "connections", list, []))
    ]
    numbers = {
        key: float(_typed(path, content, key, (int, float), 0.0))
        for key in ("step", "tolerance", "start_time", "stop_time")
        if key in content
    }
    outputs = _typed(path, content, "outputs", list, [])
    if not all(isinstance(name, str) for name in outputs):
        raise StickslipError(f"'{path}': outputs are names, each in quotes.")
    return CoupledSystem(
        path.stem,
        units,
        tuple(connections),
        solver=_typed(path, content, "solver", str, "auto"),
        adaptive=_typed(path, content, "adaptive", bool, None),
        outputs=tuple(outputs),
        **numbers,
    )


def _unit(path: Path, name: str, table: Any) -> Unit:
    where = f"'{path}': unit '{name}'"
    if not isinstance(table, dict):
        raise StickslipError(f'{where} must be a table: [units.{name}] with fmu = "FILE.fmu".')
    _known(where, table, UNIT_KEYS)
    if ("fmu" in table) == ("model" in table):
        raise StickslipError(f'{where} needs one of fmu = "FILE.fmu" and model = "NAME".')
    source = table.get("fmu", table.get("model"))
    if not isinstance(source, str):
        raise StickslipError(f"{where}: its FMU is named by text, found {source!r}.")
    contacts = table.get("contacts")
    if contacts is not None and ("fmu" in table or not isinstance(contacts, list)):
        raise StickslipError(f"{where}: contacts are a list, chosen from a model; an FMU is as it is.")
    file = path.parent / source if "fmu" in table else built(source, contacts=contacts, beside=path.parent)
    values = {key: _numbers(f"{where}, {key}", table.get(key, {})) for key in ("parameters", "start", "inputs")}
    return Unit(opened(where, file), **values)


def _connection(where: str, entry: Any) -> Connection:
    if not isinstance(entry, dict) or not all(isinstance(entry.get(key), str) for key in ("from", "to")):
        raise StickslipError(f'{where} must be {{ from = "unit.output", to = "unit.input" }}, found {entry!r}.')
    _known(where, entry, CONNECTION_KEYS)
    numbers = _numbers(where, {key: entry[key] for key in ("factor", "offset") if key in entry})
    factor = numbers.get("factor", 1.0 if "offset" in numbers else None)
    return Connection(entry["from"], entry["to"], factor, numbers.get("offset", 0.0))


def _numbers(where: str, table: Any) -> dict[str, float]:
    if not isinstance(table, dict):
        raise StickslipError(f"{where} must be a table of numbers, found {table!r}.")
    for name, value in table.items():
        if not isinstance(value, (int, float)) or not math.isfinite(value):
            raise StickslipError(f"{where}: '{name}' must be a finite number, found {value!r}.")
    return {name: float(value) for name, value in table.items()}


def _known(where: str, table: Mapping[str, Any], keys: Sequence[str]) -> None:
    for key in table:
        if key not in keys:
            raise StickslipError(f"{where} has the unknown key '{key}'.{nearest(key, keys)}")


def _typed(path: Path, table: Mapping[str, Any], key: str, kind: type | tuple[type, ...], default: Any) -> Any:
    value = table.get(key, default)
    if key in table and (not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool)):
        kinds = {dict: "a table", list: "a list", str: "text", bool: "true or false"}
        words = "a number" if isinstance(kind, tuple) else kinds[kind]
        raise StickslipError(f"'{path}': {key} must be {words}, found {value!r}.")
    return value
