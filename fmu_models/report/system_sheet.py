"""A system of FMUs on one page: units, connectors, connections, values; and drawn as boxes in boxes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from fmu_models.base import console
from fmu_models.base.table import table
from fmu_models.coupling.wiring import unit_of
from fmu_models.report.fmu_sheet import INTERFACES

if TYPE_CHECKING:
    from rich.panel import Panel

    from fmu_models.coupling.system import CoupledSystem, Unit


def sheet(system: CoupledSystem) -> dict[str, Any]:
    """The page as plain data, ready for JSON."""
    return {
        "system": system.name,
        "start_time": system.start_time,
        "stop_time": system.stop_time,
        "solver": "all units as one" if system.integrates else "co-simulation",
        "units": {name: _unit(system, name, unit) for name, unit in system.units.items()},
        "connectors": [
            {"name": name, "kind": c.kind, "type": c.type, "unit": c.unit, "value": c.value}
            | {"from": _line(c.source, c.factor, c.offset) if c.source else None}
            for name, c in system.connectors.items()
        ],
    }


def _line(source: str, factor: float, offset: float) -> str:
    shift = f" {'-' if offset < 0 else '+'} {abs(offset):g}" if offset else ""
    return f"{'' if factor == 1.0 else f'{factor:g} '}{source}{shift}"


def _unit(system: CoupledSystem, name: str, unit: Unit) -> dict[str, Any]:
    given = {**unit.parameters, **unit.start, **unit.inputs, **unit.texts}
    fed = {w.target[1]: _line(".".join(w.source), w.factor, w.offset) for w in system.wires if w.target[0] == name}
    feeds = [(w.source[1], ".".join(w.target)) for w in system.wires if w.source[0] == name]
    variables = unit.fmu.variables
    shown = dict.fromkeys((*unit.fmu.inputs, *fed, *unit.fmu.outputs, *(one for one, _ in feeds), *given))
    return {
        "file": unit.fmu.path.name,
        "model": unit.fmu.description.modelName,
        "fmi_version": unit.fmu.description.fmiVersion,
        "interfaces": [
            words for tag, words in INTERFACES.items() if getattr(unit.fmu.description, tag[0].lower() + tag[1:], None)
        ],
        "variables": [
            {
                "name": one,
                "causality": variables[one].causality,
                "type": variables[one].type,
                "unit": unit_of(unit.fmu, variables[one]),
                "value": given.get(one),
                "from": fed.get(one),
                "to": [target for source, target in feeds if source == one],
            }
            for one in shown
        ],
    }


def print_sheet(content: dict[str, Any], out: console.Console) -> None:
    """The page for people."""
    _print_head(content, out)
    units = content["units"].items()
    rows = [[name, u["file"], f"FMI {u['fmi_version']}", ", ".join(u["interfaces"])] for name, u in units]
    _print_rows(("unit", "file", "version", "interfaces"), rows, out)
    variables = [
        v | {"name": f"{name}.{v['name']}", "kind": v["causality"]} for name, u in units for v in u["variables"]
    ]
    rows = [[v["name"], v["kind"], v["type"] or "", v["unit"] or "", _value(v), v["from"] or ""]
            for v in (*content["connectors"], *variables)]  # fmt: skip
    _print_rows(("connector", "kind", "type", "unit", "value", "from"), rows, out)


def print_drawing(content: dict[str, Any], out: console.Console) -> None:
    """Boxes with inputs and values on the left and outputs on the right, systems around what is in them."""
    _print_head(content, out)
    out.print(_box(content, ""))


def _print_head(content: dict[str, Any], out: console.Console) -> None:
    times = f"{content['start_time']:g} s to {content['stop_time']:g} s"
    out.print(console.plain(f"{content['system']}: {len(content['units'])} units, {times}, {content['solver']}"))


def _print_rows(heads: tuple[str, ...], rows: list[list[str]], out: console.Console) -> None:
    if rows:
        out.print(table("", heads, rows))


def _value(variable: dict[str, Any]) -> str:
    value = variable["value"]
    return "" if value is None else f"{value:g}" if isinstance(value, (int, float)) else str(value)


def _box(content: dict[str, Any], at: str) -> Panel:
    """The box of an element by its dotted path."""
    from rich.console import Group
    from rich.panel import Panel
    from rich.table import Table
    from rich.text import Text

    start = f"{at}." if at else ""
    unit = content["units"].get(at)
    own = [c | {"name": c["name"][len(start) :]} for c in content["connectors"] if c["name"].startswith(start)]
    variables = unit["variables"] if unit else [c for c in own if "." not in c["name"]]
    ends: dict[bool, list[str]] = {False: [], True: []}
    for v in variables:
        ends[v.get("causality", v.get("kind")) in ("output", "calculatedParameter")].append(_words(v))
    grid = Table.grid(expand=True)
    grid.add_column()
    grid.add_column(justify="right")
    if variables:
        grid.add_row(*(Text("\n").join(map(console.plain, words)) for words in ends.values()))
    paths = (*content["units"], *(c["name"].rpartition(".")[0] for c in content["connectors"]))
    inner = dict.fromkeys(p[len(start) :].partition(".")[0] for p in paths if p.startswith(start) and p != at)
    boxes: Iterable[Panel] = () if unit else [_box(content, f"{start}{name}") for name in inner if name]
    title = f"{at.rpartition('.')[2]}: {unit['file']}" if unit else at.rpartition(".")[2] or content["system"]
    return Panel(Group(grid, *boxes), title=console.plain(title), title_align="left")


def _words(variable: dict[str, Any]) -> str:
    value = _value(variable)
    unit = variable["unit"] or ("" if variable["type"] in (None, "Real", "Float64") else variable["type"])
    words = variable["name"] + (f" ({unit})" if unit else "") + (f" = {value}" if value else "")
    words += f" <- {variable['from']}" if variable["from"] else ""
    return words + (f" -> {', '.join(variable['to'])}" if variable.get("to") else "")
