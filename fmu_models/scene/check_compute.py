"""What a scene computes, held against its kind and its model: keys, names, units, ranges."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from fmu_models.analyses.declaration import NO_BOX, NO_RAMP, PARAMETERS, STATE, STATES
from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.toml_document import Document
from fmu_models.scene.kinds import KINDS
from fmu_models.scene.kinds.kind import Kind
from fmu_models.scene.scene import Compute

# what the reference of the manual says of each key that more than one kind reads
KEYS = {
    "kind": "what is computed; `trajectory` if left out",
    "samples": "output times of a run",
    "over": "a drive or free parameter that is varied, one run for each of `values`",
    "values": "a list, or `{ from = 0.8, to = 1.0, count = 201 }`",
    "follow": "each run begins where the one before ended",
    "panels": "another one, and the values at which all is computed again: `{ f = [0.402, 0.426] }`",
    "period": "of what forces the motion, or how often it is looked at, s",
    "forcing": "the parameter that is the frequency, in place of `period`",
    "periods": "those that a motion takes",
    "autonomous": "nothing forces the motion",
    "level": "the section is where a state crosses a value, upward: `{ v = 0 }`",
    "down": "the same, downward",
    "impacts": "the section is where this contact begins",
    "returns": "with `level`: a return map of this state alone, the others as at the start",
    "accept": "with `returns`: states of contacts at a crossing that counts, `{ lower_friction = 0 }`, 0 for stick",
    "cap": "with `returns`: time after which there is no return; 1 s if left out",
}
NEEDED = {PARAMETERS: "two free parameters or drives", STATE: STATE, STATES: STATES}  # of axes
AXES = "each a list or `{ from = -8, to = 8, count = 101 }`"


@dataclass(frozen=True)
class Names:
    """The names that a computation may use.

    Attributes:
        varied: units of drives and free parameters.
        parameters, states: units of all.
        contacts: names.
        forced: whether time forces the model.
        signals: whether it drives periodic signals, which say their period.
        of_map: whether it is a map, every step of which is a section.
        stranger: the error for a name that is none: kind of it, name, known ones, place.
    """

    varied: Mapping[str, str]
    parameters: Mapping[str, str]
    states: Mapping[str, str]
    contacts: tuple[str, ...]
    forced: bool
    signals: bool
    of_map: bool
    stranger: Callable[..., StickslipError]


def checked_compute(doc: Document, names: Names) -> Compute:
    """What the table [compute] of a scene asks for. StickslipError: what is wrong, with its line."""
    name = doc.reference("kind", "compute", default="trajectory")
    try:
        kind = KINDS.load(name, doc.path.parent)
    except StickslipError as error:
        raise doc.fault(str(error), "compute", "kind") from error
    if names.of_map and not kind.of_maps:
        fit = ", ".join(n for n in KINDS.members() if KINDS.load(n).of_maps)
        path = ("compute", "kind") if "kind" in doc.table("compute") else ("model",)
        raise doc.fault(f"a {name} is of a motion in time, which a map has none of. Choose a kind: {fit}.", *path)
    doc.check_keys((*KEYS, *kind.settings, *(("axes",) if kind.axes else ())), "compute")
    table = doc.table("compute")
    over = _over(doc, names, table)
    if kind.sweeps and over is None:
        raise doc.fault(f"a {name} needs 'over' and 'values': what is varied, and which values it takes.", "compute")
    return Compute(
        kind=name,
        samples=doc.count("samples", 2001, 2, "compute"),
        over=over,
        values=tuple(doc.values(table["values"], names.varied[over], "compute", "values")) if over else (),
        follow=doc.flag("follow", "compute"),
        panels=_panels(doc, names, over),
        periods=doc.count("periods", 1, 1, "compute"),
        autonomous=doc.flag("autonomous", "compute"),
        axes=_axes(doc, names, name, kind),
        settings={key: _setting(doc, names, key, default) for key, default in kind.settings.items() if key in table},
        **_section(doc, names, name, kind, table),
    )


def _over(doc: Document, names: Names, table: Mapping[str, Any]) -> str | None:
    """The name of what is varied."""
    over = table.get("over")
    if over is not None:
        over = doc.text("over", "compute")
        _check_varied(doc, names, over, "compute", "over")
    if (over is None) != ("values" not in table):
        raise doc.fault("'over' and 'values' go together: what is varied, and which values it takes.", "compute")
    return over


def _check_varied(doc: Document, names: Names, name: str, *path: str) -> None:
    if name not in names.varied:
        hint = " It is fixed: move it to [free]." if name in names.parameters else nearest(name, names.varied)
        raise doc.fault(f"'{name}' is neither a drive nor free.{hint}", *path)


def _panels(doc: Document, names: Names, over: str | None) -> dict[str, tuple[float, ...]]:
    """What the panels are of, and its values."""
    table, path = doc.table("compute", "panels"), ("compute", "panels")
    if len(table) > 1 or over in table:
        raise doc.fault(f"panels are of one quantity, which is not varied already; found {', '.join(table)}.", *path)
    for name in table:
        _check_varied(doc, names, name, *path, name)
    return {name: tuple(doc.values(raw, names.varied[name], *path, name)) for name, raw in table.items()}


def _axes(doc: Document, names: Names, name: str, kind: Kind) -> dict[str, tuple[float, ...]]:
    """Values along each axis of a family."""
    if not kind.axes:
        return {}
    table, path = doc.table("compute", "axes"), ("compute", "axes")
    allowed = names.varied if kind.axes == PARAMETERS else names.states
    if not table or len(table) != {PARAMETERS: 2, STATE: 1}.get(kind.axes, len(table)):
        raise doc.fault(
            f"a {name} needs axes over {NEEDED[kind.axes]}: [compute.axes] with NAME = "
            "{ from = ..., to = ..., count = ... }.",
            *(path if table else ("compute",)),
        )
    for axis in table:
        if kind.axes == PARAMETERS:
            _check_varied(doc, names, axis, *path, axis)
        elif axis not in allowed:
            raise names.stranger("state", axis, allowed, *path, axis)
    return {axis: tuple(doc.values(raw, allowed[axis], *path, axis)) for axis, raw in table.items()}


def _setting(doc: Document, names: Names, key: str, default: Any) -> Any:
    """A key that a kind of computation alone reads."""
    if isinstance(default, Mapping):
        if default is NO_RAMP:
            return _by_name(doc, names, key, "drive", names.varied, 2)
        return _by_name(doc, names, key, "state", names.states, 2 if default is NO_BOX else 1)
    if isinstance(default, float):
        return doc.value(doc.table("compute")[key], "1", "compute", key)
    if isinstance(default, int):
        return doc.count(key, default, 0, "compute")
    return doc.text(key, "compute")


def _by_name(
    doc: Document, names: Names, key: str, kind: str, units: Mapping[str, str], count: int = 1
) -> dict[str, Any]:
    """A number by the name of a state or drive, or a list of ``count``, in its unit."""
    numbers: dict[str, Any] = {}
    for name, raw in doc.table("compute", key).items():
        path = ("compute", key, name)
        if name not in units:
            raise names.stranger(kind, name, units, *path)
        if count == 1:
            numbers[name] = doc.value(raw, units[name], *path)
        elif isinstance(raw, list) and len(raw) == count:
            # a list, as JSON gives it back
            numbers[name] = [doc.value(end, units[name], *path) for end in raw]
        else:
            raise doc.fault(f"'{name}' must be a list of {count} numbers, found {raw!r}.", *path)
    return numbers


def _section(doc: Document, names: Names, name: str, kind: Kind, table: Mapping[str, Any]) -> dict[str, Any]:
    """When a motion is looked at: once per period, at a level of a state, or where a contact begins."""
    forcing, impacts = (doc.text(key, "compute") if key in table else None for key in ("forcing", "impacts"))
    if forcing is not None and forcing not in names.parameters:
        raise names.stranger("parameter", forcing, names.parameters, "compute", "forcing")
    if impacts is not None and impacts not in names.contacts:
        raise names.stranger("contact", impacts, names.contacts, "compute", "impacts")
    period = doc.value(table["period"], "s", "compute", "period") if "period" in table else None
    if period is not None and period <= 0.0:
        raise doc.fault(f"the period must be positive, found {period:g} s.", "compute", "period")
    if names.of_map and (forcing or period):
        key = "forcing" if forcing else "period"
        raise doc.fault("of a map every step is looked at: leave the period out.", "compute", key)
    level = _by_name(doc, names, "level", "state", names.states)
    returns = doc.text("returns", "compute") if "returns" in table else None
    if returns is not None and returns not in names.states:
        raise names.stranger("state", returns, names.states, "compute", "returns")
    if (returns and not level) or (not returns and {"accept", "cap"} & set(table)):
        raise doc.fault("a return map needs 'level', where the motion returns, and 'returns', its state.", "compute")
    if len(level) > 1 or (level and impacts):
        raise doc.fault("a section is a level of one state, or where a contact begins: name one of them.", "compute")
    elsewhere, accept = bool(level or impacts), doc.table("compute", "accept")
    if elsewhere and (names.of_map or not kind.anywhere):
        once = "step" if names.of_map else "period"
        raise doc.fault(f"a {name} is of a motion seen once per {once}; leave 'level' and 'impacts' out.", "compute")
    timed = (period is None) != (forcing is None)
    free = elsewhere or names.of_map or names.signals or (kind.unforced and not names.forced)
    if kind.periodic and not timed and not (free and period is None):
        others = ", or a section: 'level' or 'impacts'" if kind.anywhere else ""
        raise doc.fault(
            f"a {name} needs either 'period', s, or 'forcing', the parameter that is the frequency{others}.", "compute"
        )
    return {
        "period": period,
        "forcing": forcing,
        "angular": forcing is not None and names.parameters[forcing] == "rad/s",
        "level": level,
        "down": doc.flag("down", "compute"),
        "impacts": impacts,
        "returns": returns,
        "accept": {name: doc.value(raw, "1", "compute", "accept", name) for name, raw in accept.items()},
        "cap": doc.value(table.get("cap", 1.0), "s", "compute", "cap") if returns else 1.0,
    }
