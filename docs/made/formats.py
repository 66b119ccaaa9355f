"""Reference of files that one writes: keys of a scene, a recipe and the sidecar of logs, as the checks know them."""

from __future__ import annotations

import importlib
import inspect
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import MISSING, fields
from math import inf
from typing import Any, Literal, get_args, get_origin, get_type_hints

from fmu_models.analyses.declaration import ANALYSES
from fmu_models.scene.check import KEYS as SCENE
from fmu_models.scene.check_compute import AXES
from fmu_models.scene.check_compute import KEYS as COMPUTE
from fmu_models.scene.kinds import KINDS
from identification.machines.axis import FRICTION_KEYS, TERM_KEYS
from identification.machines.axis import KINDS as TERMS
from identification.machines.joint_laws import comparable
from identification.measurement.recipe import (
    FILTER_KEYS,
    IMPLIED,
    ROLES,
    SAMPLING_KEYS,
    SAVITZKY_GOLAY_KEYS,
    SIGNAL_KEYS,
    TASKS,
)
from identification.measurement.recipe import KEYS as RECIPE
from identification.slips.statistics import SETTINGS
from rig_io.logs import packed
from rig_io.logs.columns import ANGLE_SOURCES, COLUMNS, TIME
from rig_io.logs.log import (
    RIG_UNITS,
    EncoderCalibration,
    Experiment,
    InstrumentCalibrations,
    LaserCalibration,
    LoadCalibration,
    RigConstants,
)
from rig_io.packages.described import FIELD_KEYS
from rig_io.packages.sidecar import LOG_KEYS, PACKAGE_KEYS, QUANTITY_KEYS
from rig_io.readers import READERS

JSON = {str: "text", bool: "true or false", int: "whole number", float: "number", Mapping: "object"}
KINDS_OF = {LaserCalibration: "laser", EncoderCalibration: "encoder, drive0, drive1", LoadCalibration: "load0, load1"}


def pages() -> Iterator[tuple[str, str]]:
    """A page for each of the formats."""
    for name, parts in (("scene", _scene()), ("recipe", _recipe()), ("sidecar", _sidecar())):
        yield f"reference/{name}.md", "\n\n".join(parts) + "\n"


def _scene() -> Iterator[str]:
    yield "# Keys of a scene"
    yield (
        'A value is a number in the unit of the model, or a text of number and unit: `0.83`, `"8 rpm"`, `"5 deg"`. '
        "`stickslip scene` lists the scenes that come along; copy one to begin with: `stickslip data copy "
        "scenes/disc_rig_class_a`. A key that nobody reads is refused, with its line."
    )
    yield _table(("key or table", "meaning"), SCENE.items())
    yield "## [compute]"
    yield _table(("key", "meaning"), COMPUTE.items())
    for name in KINDS.members():
        kind = KINDS.load(name)
        yield f'## kind = "{name}"\n\n{_kind(name)}'
        if kind.axes:
            yield f"`[compute.axes]`: {kind.axes}, {AXES}."
        if kind.settings:
            own = ", ".join(f"`{key}` ({_default(value)})" for key, value in kind.settings.items())
            yield f"Keys of its own: {own}."
    yield "## [sensors]"
    yield _literal("rig_io.bench.scenes")


def _kind(name: str) -> str:
    """What a kind computes, and the names of its results."""
    if name in ANALYSES.members():
        analysis = ANALYSES.load(name)
        return f"{analysis.summary}\n\nResults: {analysis.results}."
    return inspect.cleandoc(importlib.import_module(f"{KINDS.package}.{name}").__doc__ or "").replace("``", "`")


def _default(value: object) -> str:
    return "not set" if value is None or isinstance(value, Mapping) else f"`{value}` if left out"


def _literal(module: str) -> str:
    """What a module says, its indented block as one of code."""
    said = inspect.cleandoc(importlib.import_module(module).__doc__ or "")
    return re.sub(r"\n\n((?: {4}.*\n)+)", lambda block: f"\n\n```text\n{inspect.cleandoc(block[1])}\n```\n", said)


def _recipe() -> Iterator[str]:
    yield "# Keys of a recipe"
    yield (
        "A recipe (TOML) says how the columns of a log become signals, and what is to be found in them; it holds no "
        f"data. Of {' and '.join(f'`[{task}]`' for task in TASKS)} it needs one. A value is a number in the unit told "
        'here, or a text of number and unit: `"30.7 g"`. `stickslip data` lists the recipes that come along; copy one '
        "to begin with: `stickslip data copy recipes/axis`. A key that nobody reads is refused, with its line."
    )
    yield _table(("key", "meaning"), RECIPE.items())
    yield "## [signals.NAME]"
    yield _table(("key", "meaning"), SIGNAL_KEYS.items())
    yield _table(("signal", "unit", "meaning"), ((name, " or ".join(r.units), r.meaning) for name, r in ROLES.items()))
    implied = " and ".join(f"`{name}` (of `{of}`)" for name, of in IMPLIED.items())
    yield f"Left out, {implied} are derivatives by central differences. Signals of other names serve these."
    yield "### filter"
    yield _table(("key", "meaning"), FILTER_KEYS.items())
    yield "### savitzky_golay"
    yield _table(("key", "meaning"), SAVITZKY_GOLAY_KEYS.items())
    yield "## [sampling]"
    yield _table(("key", "meaning"), SAMPLING_KEYS.items())
    yield "## [terms]"
    yield (
        'A parameter each, and its term: `Fv = "viscous"`, or a table, `Fc = { term = "coulomb-tanh", speed = '
        '"0.01 rad/s" }`. The effort is the sum of parameters times columns, of position q, velocity `q\'` and '
        "acceleration `q''`. Parameters are named in letters a to z and digits, in quotation marks with what else "
        'stands between: `"m cx"`, `"Fc+"`.'
    )
    yield _table(("key", "meaning"), TERM_KEYS.items())
    rows = (
        (name, f"`{one.column}`", one.meaning, one.sliding_unit or "none", one.turning_unit, one.needs or "")
        for name, one in TERMS.items()
    )
    yield _table(("term", "column", "parameter", "unit of a body that slides", "that turns", "needed signal"), rows)
    yield "## [friction]"
    yield _table(("key", "meaning"), FRICTION_KEYS.items())
    yield f"Laws that can be compared: {_codes(comparable())}."
    yield "## [slips]"
    yield _table(("key", "unit", "meaning"), ((name, one.unit, one.meaning) for name, one in SETTINGS.items()))
    yield "`--set` replaces them, in these units."


def _sidecar() -> Iterator[str]:
    yield "# Keys of the sidecar of logs"
    yield (
        "Logs of a folder are described in its `datapackage.json` ([Frictionless Data Package]"
        "(https://specs.frictionlessdata.io/data-package/)), which `stickslip describe` writes. These are the keys "
        "that are read; the others of the standard may stand beside them."
    )
    yield _table(("key", "meaning"), PACKAGE_KEYS.items())
    yield "## resources"
    yield _table(("key of a log", "meaning"), LOG_KEYS.items())
    yield "## fields"
    yield _table(("key of a column", "meaning"), FIELD_KEYS.items())
    rows = ((f"`{one.name}`", one.unit, one.description) for one in COLUMNS.values())
    yield _table(("role", "unit", "meaning"), rows)
    yield (
        f"Needed are `{TIME.name}` and one of {_codes(ANGLE_SOURCES)}; a column without a role is left unread "
        "(`rig_io.read_table` reads any, under its name). Each needs a unit, here or in the file (`time [s]`, a row "
        "below the header, an attribute). Another unit of the same dimension is converted; two that contradict each "
        "other are refused. What becomes of a damaged log: [logs as recorders leave them](../how_to/damaged_logs.md)."
    )
    yield "## dialect"
    yield _table(("files", "options"), _readers())
    yield "## rig\n\n" + _said(RigConstants)
    yield _table(("constant", "unit"), RIG_UNITS.items())
    yield _table(("key of a constant", "meaning"), QUANTITY_KEYS.items())
    yield "## experiment\n\n" + _said(Experiment)
    yield _fields(Experiment)
    yield "`guessed`: what of it nobody has confirmed, and why it was guessed. Any other key is refused."
    yield "## calibration\n\n" + _said(InstrumentCalibrations)
    for kind, instruments in KINDS_OF.items():
        yield f"### {instruments}\n\n" + _said(kind)
        yield _fields(kind)


def _readers() -> Iterator[tuple[str, str]]:
    """Suffixes and options of each kind of file."""
    for name in READERS.members():
        reader = READERS.load(name)
        yield _codes(reader.suffixes), "; ".join(f"`{key}`: {what}" for key, what in reader.options.items())
    yield _codes(packed.SUFFIXES), f"`{packed.MEMBER}`: file in the archive; and those of that file"


def _codes(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _said(kind: type) -> str:
    return (inspect.getdoc(kind) or "").replace("``", "`").replace("*", "\\*")


def _fields(kind: type[Any]) -> str:
    types, rows = get_type_hints(kind), []
    for one in fields(kind):
        needed = one.default is MISSING and one.default_factory is MISSING
        # neither an object nor a bound that is not there can be written
        given = "" if one.default in (None, MISSING, (), inf, -inf) else f"`{json.dumps(one.default)}`"
        rows.append((one.name, _words(types[one.name]), "needed" if needed else given))
    return _table(("key", "type", "if left out"), rows)


def _words(kind: Any) -> str:
    """A type as JSON has it."""
    parts = [one for one in get_args(kind) if one not in (type(None), Ellipsis)]
    if get_origin(kind) is Literal:
        return " or ".join(f'`"{one}"`' for one in parts)
    if get_origin(kind) is tuple:
        return f"list: {_words(parts[0])}"
    return JSON.get(get_origin(kind) or kind) or _words(parts[0])


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]] | Mapping[str, str]) -> str:
    lines = [head, ("---",) * len(head)]
    for first, *others in rows:
        lines.append((first if first.startswith("`") else f"`{first}`", *(text.replace("|", "\\|") for text in others)))
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
