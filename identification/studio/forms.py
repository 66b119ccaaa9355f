"""Commands as forms: fields of what they take, the arguments that filled-in fields make, and what may come next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from fmu_models.base.errors import StickslipError
from fmu_models.base.toml_document import read_document

Values = Mapping[str, Sequence[str]]  # by field

# what the studio does itself
UNASKED = ("help", "json")
# files that a command writes when it is told where, as a form proposes them
PROPOSED = {
    "result": "{command}.json",
    "figure": "{command}.svg",
    **({"interactive": "{command}.html"} if find_spec("plotly") else {}),
}
# what goes to --output, by another option of the command: points of the picture of a family of motions, from which the
# next command may begin; what is fitted, as an FMU (a scene or an SSP by another suffix)
OUTPUTS = {"forcing": "{command}.csv", "curve": "{command}.csv", "names": "fitted.fmu"}
# commands that go on where one ends; fields of the same name go with them, and those of another name by RENAMED
NEXT = {
    "describe": ("fit", "laws"),
    "fit": ("report", "compare", "apply", "design"),
    "laws": ("fit",),
    "inspect": ("simulate", "diagram", "couple"),
    "export": ("inspect", "simulate", "explore"),
    "simulate": ("explore", "diagram"),
    "explore": ("simulate", "diagram", "export"),
    "show": ("explore", "simulate", "diagram", "export"),
    "diagram": ("basins", "branch", "simulate", "lyapunov"),
    "basins": ("branch", "simulate", "lyapunov"),
    "branch": ("basins", "diagram", "simulate"),
    "chart": ("basins", "branch", "simulate"),
    "equilibria": ("simulate", "basins", "branch"),
    "scene": ("export", "explore", "simulate"),
    "apply": ("explore", "simulate", "inspect", "scene"),
    "calibrate": ("report", "apply"),
    "inverse": ("report", "apply"),
}
CLICKED = ("diagram", "basins", "branch", "chart", "equilibria")  # whose pictures, as .svg, say what they span
SUBJECTS = ("model", "path")
RENAMED = {"files": "logs", "result": "fitted"}
# which the next one has anew
OF_A_RUN = ("figure", "interactive", "output", "over", "overwrite", "path", "resume", "workers")
# what a form shows at once, beside what is needed; what is written stands under "Files", the rest under "More options"
FIRST = (
    *("over", "forcing", "period", "settings", "start", "until", "inputs", "of", "law", "laws", "estimator", "speeds"),
    *("material", "free", "source", "columns", "units", "fmi"),
)
WRITTEN = ("result", "figure", "interactive", "output", "corner", "page", "path", "plot", "overwrite")


@dataclass(frozen=True)
class Field:
    """name: of the parameter; flag: how it is given, "" for an argument; kind: "flag", "lines" (several) or "text"."""

    name: str
    flag: str
    kind: str
    help: str
    hint: str
    required: bool
    default: str
    off: str = ""

    @property
    def label(self) -> str:
        """Its name for people."""
        return (self.flag.removeprefix("--") or self.name).replace("-", " ").replace("_", " ")


def fields(command: Any) -> list[Field]:
    """Fields of a command of typer: those that must be filled in, what it is of, those that most want to say, the
    others."""
    listed = [_field(parameter) for parameter in command.params if parameter.name not in UNASKED]
    places = {name: place for place, name in enumerate(FIRST)}
    return sorted(listed, key=lambda field: (not field.required, field.flag != "", places.get(field.name, len(FIRST))))


def groups(found: Sequence[Field], values: Values) -> dict[str, list[Field]]:
    """Fields by the heading that they stand under, "" for those that are always seen; none that is empty."""
    parts: dict[str, list[Field]] = {"": [], "Files": [], "More options": []}
    for field in found:
        filled_in = any(values.get(field.name, ())) and values[field.name] != [field.default]
        seen = field.required or not field.flag or field.name in FIRST or (filled_in and field.name not in WRITTEN)
        parts["" if seen else "Files" if field.name in WRITTEN else "More options"].append(field)
    return {heading: part for heading, part in parts.items() if part}


def _field(parameter: Any) -> Field:
    is_argument = parameter.param_type_name == "argument"
    several = parameter.nargs == -1 or bool(getattr(parameter, "multiple", False))
    kind = "flag" if getattr(parameter, "is_flag", False) else "lines" if several else "text"
    on = max(parameter.opts, key=len)
    off = max(parameter.secondary_opts, key=len, default="")
    default = "" if parameter.default is None or isinstance(parameter.default, tuple) else str(parameter.default)
    hint = (parameter.metavar or "").removesuffix("...")
    text = getattr(parameter, "help", None) or ""
    return Field(parameter.name, "" if is_argument else on, kind, text, hint, parameter.required, default, off)


def proposals(command: str, found: Sequence[Field]) -> dict[str, list[str]]:
    """What a form begins with."""
    values = {field.name: [field.default] for field in found if field.default and field.kind != "lines"}
    names = {field.name for field in found}
    for name, file in PROPOSED.items():
        if name in names and next(field.kind for field in found if field.name == name) == "text":
            values[name] = [file.format(command=command)]
    for name in names & OUTPUTS.keys():
        values["output"] = [OUTPUTS[name].format(command=command)]
    if "overwrite" in names:
        values["overwrite"] = ["True"]
    return values


def carried(values: Values, found: Sequence[Field]) -> dict[str, list[str]]:
    """What goes over from the form of the command before."""
    names = {field.name: field.kind for field in found}
    over = {
        name: list(value)
        for name, value in values.items()
        if name in names and name not in OF_A_RUN and any(value) and (value == ["True"] or names[name] != "flag")
    }
    if "model" not in values and values.get("path"):  # what `inspect` looked into
        over |= {field.name: list(values["path"]) for field in found if field.name in SUBJECTS and not field.flag}
    for name, other in RENAMED.items():
        if other in names and values.get(name):
            over[other] = list(values[name])
            over.pop(name, None)
    return over


def looking_into(path: Path) -> str:
    """The command that looks into a file. StickslipError: a .toml file that cannot be read."""
    if path.suffix in (".fmu", ".ssp", ".ssd"):
        return "inspect"
    if path.suffix == ".toml":
        return "couple" if "units" in read_document(path).data else "scene"
    return "show"


def arguments(command: str, found: Sequence[Field], values: Values) -> list[str]:
    """The command line of a form. What is left as it is by itself is not said. StickslipError: a field is empty that
    must be filled in."""
    line = [command]
    for field in found:
        lines = [text.strip() for value in values.get(field.name, ()) for text in value.splitlines() if text.strip()]
        if field.required and not lines:
            raise StickslipError(f"'{field.label}' is empty. {field.help}")
        if field.kind == "flag":
            on, default = lines == ["True"], field.default == "True"
            line += [] if on == default else [field.flag if on else field.off]
        elif lines and lines != [field.default]:
            line += [word for text in lines for word in (_given(field.flag, text) if field.flag else (text,))]
    return line


def _given(flag: str, text: str) -> tuple[str, ...]:
    return (f"{flag}={text}",) if text.startswith("-") else (flag, text)
