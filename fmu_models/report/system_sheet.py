"""A system of FMUs on one page: units, connectors, values and what feeds them; or drawn as boxes in boxes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fmu_models.base import console
from fmu_models.base.table import table
from fmu_models.coupling.wiring import unit_of
from fmu_models.report.fmu_sheet import INTERFACES

if TYPE_CHECKING:
    from rich.panel import Panel

    from fmu_models.coupling.system import CoupledSystem, Unit


def sheet(system: CoupledSystem) -> dict[str, Any]:
    """The page as plain data, ready for JSON; connectors are those of systems and of units, by dotted names."""
    outer = [
        {"name": name, "kind": c.kind, "type": c.type, "unit": c.unit, "value": c.value}
        | {"from": _line(c.source, c.factor, c.offset) if c.source else None, "to": []}
        for name, c in system.connectors.items()
    ]
    return {
        "system": system.name,
        "start_time": system.start_time,
        "stop_time": system.stop_time,
        "solver": "all units as one" if system.integrates else "co-simulation",
        "units": {
            name: {"file": unit.fmu.path.name, "fmi_version": unit.fmu.description.fmiVersion}
            | {"interfaces": [INTERFACES[tag] for tag in unit.fmu.interfaces]}
            for name, unit in system.units.items()
        },
        "connectors": outer + [row for name, unit in system.units.items() for row in _rows(system, name, unit)],
    }


def _line(source: str, factor: float, offset: float) -> str:
    shift = f" {'-' if offset < 0 else '+'} {abs(offset):g}" if offset else ""
    return f"{'' if factor == 1.0 else f'{factor:g} '}{source}{shift}"


def _rows(system: CoupledSystem, name: str, unit: Unit) -> list[dict[str, Any]]:
    """Inputs, outputs, what is connected and what is given a value."""
    values = {**unit.parameters, **unit.start, **unit.inputs, **unit.texts}
    fed = {w.target[1]: _line(".".join(w.source), w.factor, w.offset) for w in system.wires if w.target[0] == name}
    feeds = [(w.source[1], ".".join(w.target)) for w in system.wires if w.source[0] == name]
    shown = dict.fromkeys((*unit.fmu.inputs, *fed, *unit.fmu.outputs, *(one for one, _ in feeds), *values))
    return [
        {"name": f"{name}.{v.name}", "kind": v.causality, "type": v.type, "unit": unit_of(unit.fmu, v)}
        | {"value": values.get(one), "from": fed.get(one), "to": [target for source, target in feeds if source == one]}
        for one in shown if (v := unit.fmu.variables[one])
    ]  # fmt: skip


def print_sheet(content: dict[str, Any], out: console.Console) -> None:
    """The page for people."""
    _print_head(content, out)
    units = [[n, u["file"], f"FMI {u['fmi_version']}", ", ".join(u["interfaces"])] for n, u in content["units"].items()]
    heads = ("connector", "kind", "type", "unit", "value", "from")
    rows = [
        [*(c[key] or "" for key in ("name", *heads[1:4])), _value(c), c["from"] or ""] for c in content["connectors"]
    ]
    out.print(table("", ("unit", "file", "version", "interfaces"), units))
    out.print(table("", heads, rows))


def print_drawing(content: dict[str, Any], out: console.Console) -> None:
    """Boxes with inputs and values on the left and outputs on the right, systems around what is in them."""
    _print_head(content, out)
    out.print(_box(content, ""))


def _print_head(content: dict[str, Any], out: console.Console) -> None:
    times = f"{content['start_time']:g} s to {content['stop_time']:g} s"
    out.print(console.plain(f"{content['system']}: {len(content['units'])} units, {times}, {content['solver']}"))


def _value(connector: dict[str, Any]) -> str:
    value = connector["value"]
    return "" if value is None else f"{value:g}" if isinstance(value, (int, float)) else str(value)


def _box(content: dict[str, Any], at: str) -> Panel:
    """The box of an element by its dotted path."""
    from rich.console import Group
    from rich.panel import Panel
    from rich.table import Table
    from rich.text import Text

    start, unit = f"{at}." if at else "", content["units"].get(at)
    below = [c | {"name": c["name"][len(start) :]} for c in content["connectors"] if c["name"].startswith(start)]
    words: dict[bool, list[Text]] = {False: [], True: []}
    for c in below if unit else (c for c in below if "." not in c["name"]):
        words[c["kind"] in ("output", "calculatedParameter")].append(console.plain(_words(c)))
    ends = Table.grid(expand=True)
    ends.add_column()
    ends.add_column(justify="right")
    ends.add_row(*map(Text("\n").join, words.values()))
    paths = (*content["units"], *(f"{start}{c['name']}".rpartition(".")[0] for c in below))
    names = dict.fromkeys(p[len(start) :].partition(".")[0] for p in paths if p.startswith(start) and p != at)
    boxes = () if unit else [_box(content, f"{start}{name}") for name in names if name]
    title = (at.rpartition(".")[2] or content["system"]) + (f": {unit['file']}" if unit else "")
    return Panel(Group(ends, *boxes), title=console.plain(title), title_align="left")


def _words(connector: dict[str, Any]) -> str:
    unit = connector["unit"] or ("" if connector["type"] in (None, "Real", "Float64") else connector["type"])
    value, targets = _value(connector), ", ".join(connector["to"])
    source = f" <- {connector['from']}" if connector["from"] else ""
    words = connector["name"] + (f" ({unit})" if unit else "") + (f" = {value}" if value else "")
    return f"{words}{source}" + (f" -> {targets}" if targets else "")
