"""One page about an FMU of anybody, from its description alone: its library is not loaded."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from fmu_models.base import console
from fmu_models.base.table import Cell, PrintedColumn, table
from fmu_models.fmu.library import platforms, sources, this_folder
from fmu_models.report.run_summary import LISTED, print_unlisted

if TYPE_CHECKING:
    from fmpy.model_description import ModelDescription, ModelVariable

    from fmu_models.fmu.fmu import Fmu

INTERFACES = {
    "ModelExchange": "Model Exchange",
    "CoSimulation": "Co-Simulation",
    "ScheduledExecution": "Scheduled Execution",
}
CAUSALITIES = (
    *("structuralParameter", "parameter", "calculatedParameter"),
    *("input", "output", "local", "independent"),
)
YES_OR_NO = ("can", "completed", "has", "might", "needs", "provides")  # beginnings of the attributes that are


def sheet(fmu: Fmu) -> dict[str, Any]:
    """The page as plain data, ready for JSON."""
    d = fmu.description
    packed = platforms(fmu)
    return {
        "file": str(fmu.path),
        "bytes": fmu.path.stat().st_size,
        "sha256": fmu.sha256,
        "model": d.modelName,
        "description": d.description,
        "fmi_version": d.fmiVersion,
        "token": d.guid,
        "generation_tool": d.generationTool,
        "generation_date": d.generationDateAndTime,
        "author": d.author,
        "license": d.license,
        "interfaces": _interfaces(fmu),
        "platforms": packed,
        "runs_here": this_folder(fmu) in packed,
        "sources": sources(fmu),
        "states": fmu.states,
        "event_indicators": d.numberOfEventIndicators,
        "default_experiment": _experiment(d),
        "variables": [_variable(v) for v in d.modelVariables],
        "problems": fmu.problems,
    }


def _interfaces(fmu: Fmu) -> list[dict[str, Any]]:
    """What each interface declares, in the words of the standard."""
    interfaces = []
    for tag, stated in fmu.interfaces.items():
        capabilities = [
            name if name.startswith(YES_OR_NO) else f"{name} = {value}"
            for name, value in stated.items()
            if value not in ("false", "0") and name != "modelIdentifier"
        ]
        identifier = stated.get("modelIdentifier")
        interfaces.append({"kind": INTERFACES[tag], "identifier": identifier, "capabilities": capabilities})
    return interfaces


def _experiment(d: ModelDescription) -> dict[str, Any]:
    stated = d.defaultExperiment
    names = ("startTime", "stopTime", "tolerance", "stepSize")
    return {name: _number(getattr(stated, name)) for name in names if stated and getattr(stated, name) is not None}


def _variable(v: ModelVariable) -> dict[str, Any]:
    return {
        "name": v.name,
        "causality": v.causality,
        "variability": v.variability,
        "type": v.type,
        "unit": v.unit or (v.declaredType.unit if v.declaredType else None),
        "start": v.start if v.type in ("String", "Binary") else _number(v.start),
        "shape": list(v.shape or ()),
        "description": v.description,
    }


def _number(text: str | None) -> float | int | bool | str | None:
    """A value of the description as JSON has it; a list, or what is no number, stays as it is written."""
    if text in ("true", "false"):
        return text == "true"
    for kind in (int, float):
        try:
            value = kind(text or "")
        except ValueError:
            continue
        return value if math.isfinite(value) else text
    return text


def print_sheet(content: dict[str, Any], out: console.Console) -> None:
    """The page for people."""
    plain = console.plain
    head = f"FMI {content['fmi_version']}, {content['bytes'] / 1000:.0f} kB"
    maker = f"made by {content['generation_tool'] or 'an unnamed tool'}"
    out.print(plain(content["model"] or content["file"], "bold"), plain(f"{head}, {maker}"))
    if content["description"]:
        out.print(plain(content["description"]))
    for interface in content["interfaces"]:
        capable = ", ".join(interface["capabilities"]) or "no optional capability"
        out.print(plain(f"{interface['kind']} ({interface['identifier']}): {capable}"))
    platform = "runs here" if content["runs_here"] else "none for this machine"
    n_sources = len(content["sources"])
    built = f"{n_sources} source files" + ("" if content["runs_here"] else ", built when it is simulated")
    out.print(plain(f"platforms: {', '.join(content['platforms']) or 'none'} ({platform})"))
    out.print(plain(f"sources: {built if n_sources else 'none'}"))
    out.print(plain(f"continuous states: {len(content['states'])}; event indicators: {content['event_indicators']}"))
    if content["default_experiment"]:
        stated = ", ".join(f"{name} {value}" for name, value in content["default_experiment"].items())
        out.print(plain(f"default experiment: {stated}"))
    for causality in CAUSALITIES:
        _print_variables([v for v in content["variables"] if v["causality"] == causality], causality, out)
    if content["problems"]:
        out.print(plain("Where it departs from the standard:"))
        for problem in content["problems"][:LISTED]:
            out.print(plain(f"  {problem}"))
        print_unlisted(len(content["problems"]) - LISTED, out)
    else:
        out.print(plain("Its description keeps to the standard as far as was checked."))


def _print_variables(variables: list[dict[str, Any]], causality: str, out: console.Console) -> None:
    if not variables:
        return
    rows = [
        [
            v["name"],
            Cell("" if v["start"] is None else str(v["start"]), "number"),
            v["unit"] or "",
            v["type"] + (str(v["shape"]) if v["shape"] else ""),
            v["variability"] or "",
            v["description"] or "",
        ]
        for v in variables[:LISTED]
    ]
    columns = (
        causality,
        "start",
        "unit",
        PrintedColumn("type", spare=1),
        PrintedColumn("variability", spare=2),
        "description",
    )
    out.print(table("", columns, rows))
    print_unlisted(len(variables) - LISTED, out)
