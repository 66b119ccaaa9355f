"""A system of several FMUs, read from a TOML file.

connections = [{ from = "rig.F0", to = "motor0.force" }, { from = "motor0.w", to = "rig.w0" }]
stop_time = 10.0

[units.rig]
fmu = "rig.fmu"                 # beside this file or below, or: model = "disc_rig", contacts = ["disc0"]
parameters = { N0 = 3.0 }
start = { theta = 0.1 }
inputs = { w1 = "speed.csv:w" } # a number, or a column of a log beside this file
"""

import os
from typing import Any

from fmu_models.base import shipped
from fmu_models.base.errors import StickslipError
from fmu_models.base.files import named_file
from fmu_models.base.toml_document import Document, read_document
from fmu_models.codegen.package import built
from fmu_models.coupling import ssp
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.coupling.wiring import Connection, Misfit
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.measured import column_of_log

NUMBERS = {"step": "s", "tolerance": "1", "start_time": "s", "stop_time": "s"}
VALUES = ("parameters", "start", "inputs")


def is_system(path: str) -> bool:
    """Whether a path, or the name of one that comes along, is that of a system of FMUs."""
    try:
        file = named_file(path, shipped.files("systems"), "system")
    except StickslipError:
        return False
    return file.suffix in (".ssp", ".ssd") or (file.suffix == ".toml" and "units" in read_document(file).data)


def read_system(path: str | os.PathLike[str], *, fmi_version: str = "3.0", trust: bool = False) -> CoupledSystem:
    """The system in a TOML, .ssd or .ssp file; fmi_version: of the FMUs that are built for it; trust: Python files that
    it names, and FMUs outside its folder, may run. StickslipError: no such file, not readable, or a system that does
    not fit together; says where."""
    path = named_file(path, shipped.files("systems"), "system")
    if path.suffix.lower() in (".ssp", ".ssd"):
        return ssp.read(path)
    document = read_document(path, trust=trust)
    document.check_keys(("units", "connections", "solver", "rollback", "parallel", "outputs", *NUMBERS))
    data = document.data
    units = {name: _unit(document, name, fmi_version) for name in document.table("units")}
    numbers: dict[str, Any] = {k: document.value(data[k], unit, k) for k, unit in NUMBERS.items() if k in data}
    try:
        return CoupledSystem(
            path.stem,
            units,
            _connections(document),
            solver=document.text("solver", default="auto"),
            rollback=document.flag("rollback") if "rollback" in data else None,
            parallel=document.flag("parallel"),
            outputs=document.names("outputs") or (),
            **numbers,
        )
    except Misfit as error:
        raise document.fault(str(error), *error.place) from error


def _unit(document: Document, name: str, fmi_version: str) -> Unit:
    keys = ("units", name)
    document.check_keys(("fmu", "model", "contacts", *VALUES), *keys)
    table = document.table(*keys)
    if ("fmu" in table) == ("model" in table):
        raise document.fault(f'unit \'{name}\' needs one of fmu = "FILE.fmu" and model = "NAME".', *keys)
    kind = "fmu" if "fmu" in table else "model"
    source, contacts = document.reference(kind, *keys), document.names("contacts", *keys)
    if contacts is not None and kind == "fmu":
        raise document.fault("contacts are chosen from a model; an FMU is as it is.", *keys, "contacts")
    try:
        folder = document.path.parent
        options = {"contacts": contacts, "beside": folder, "fmi_version": fmi_version}
        fmu = Fmu.open(folder / source if kind == "fmu" else built(source, **options))
    except StickslipError as error:
        raise document.fault(f"unit '{name}': {error}", *keys, kind) from error
    values = {key: document.numbers(*keys, key, texts=key == "inputs") for key in VALUES}
    for variable, text in values["inputs"].items():
        if isinstance(text, str):
            try:
                values["inputs"][variable] = ":".join(map(str, column_of_log(text, folder)))
            except StickslipError as error:
                raise document.fault(str(error), *keys, "inputs", variable) from error
    return Unit(fmu, **values)


def _connections(document: Document) -> list[Connection]:
    connections = []
    for i, entry in enumerate(document.entries("connections")):
        keys = ("connections", i)
        document.check_keys(("from", "to", "factor", "offset"), *keys)
        numbers = {key: document.value(entry[key], "1", *keys, key) for key in ("factor", "offset") if key in entry}
        factor = numbers.get("factor", 1.0 if "offset" in numbers else None)
        connections.append(
            Connection(document.text("from", *keys), document.text("to", *keys), factor, numbers.get("offset", 0.0))
        )
    return connections
