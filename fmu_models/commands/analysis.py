"""The command of an analysis, derived from its declaration."""

import ast
import inspect
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

import typer

from fmu_models.analyses.declaration import (
    ANALYSES,
    OSCILLATOR,
    PARAMETERS,
    RANGE,
    STATE,
    VALUES,
    WATCHED,
    Box,
    Declared,
)
from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.commands import families as f
from fmu_models.commands.bundles import Without, bundled

COUNTS = {VALUES: 1, STATE: 1, PARAMETERS: 2}
OF_SECTION = ("forcing", "period", "every", *WATCHED, "stepper")


def command_of(name: str) -> Callable[..., None]:
    """The command of an analysis as typer reads it: axes, section, its own options, who makes the runs, files."""
    analysis = ANALYSES.load(name)
    files: Any = f.StoredFiles if analysis.stores else f.Files
    without = (*analysis.without, *(OF_SECTION if analysis.subject == OSCILLATOR else ()))
    options: dict[str, Any] = {
        "section": Annotated[f.SectionOptions, Without(*without)],
        **{declared.name: _option(declared) for declared in analysis.options.values()},
        "runs": Annotated[f.FamilyRuns, Without(*without)],
        "files": files if analysis.page else Annotated[files, Without("interactive")],
    }
    if analysis.axes:
        options = {"over": f.Bounds if analysis.axes == RANGE else f.Ranges, **options}
    if not analysis.stores:
        del options["runs"]

    def command(**values: Any) -> None:
        section, files = values.pop("section"), values.pop("files")
        arguments = {"execution": files.execution(values.pop("runs"))} if analysis.stores else {}
        files.check()
        over = values.pop("over", None)
        if analysis.axes == RANGE:
            axes = section.range(name, over)
        else:
            axes = section.axes(name, over, COUNTS.get(analysis.axes)) if analysis.axes else {}
        values |= {of: _named(analysis.options[of], values[of]) for of in values if analysis.options[of].by_name}
        arguments |= section.options(name, **values)
        subject, constants = section.subject(analysis.subject)
        with console.progress(analysis.label) as advance:
            result = analysis.run(subject, axes, start=section.starts(), **constants, **arguments, progress=advance)
        files.tell(result, result.record(), section if analysis.page else None)
        if getattr(result, "interrupted", False):
            raise typer.Exit(console.INTERRUPTED)

    command.__name__ = name
    command.__doc__ = f"{analysis.summary}\n\nExample: stickslip {name} {analysis.example}"
    command.__annotations__ = options
    defaulted = {"over", *analysis.options}
    parameters = [
        inspect.Parameter(
            name, inspect.Parameter.KEYWORD_ONLY, default=None if name in defaulted else inspect.Parameter.empty
        )
        for name in options
    ]
    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined] # what typer reads
    return console.trusting(bundled(command))


def _option(declared: Declared) -> object:
    """Not given, the shell's option is None: then a scene, or the function's own default, says it."""
    option, kind = declared.option, declared.type
    plain = kind is bool and option.words is None
    flags = (f"--{(option.flag or declared.name).replace('_', '-')}",)
    default: Any = option.default or (declared.default is not None and not plain and str(declared.default))
    settings: dict[str, Any] = {"help": option.help, "min": option.minimum, "metavar": option.metavar}
    if option.words:
        kind, default = str, option.words[bool(declared.default)]
        settings["parser"] = partial(_worded, flags[0], option.words)
    if declared.by_name:
        kind, default = list[str], False
        settings["metavar"] = "NAME=FROM:TO" if declared.type == Box else "NAME=VALUE"
    if declared.range:
        kind = str
        settings |= {"parser": f.one_range, "metavar": "NAME=FROM:TO"}
    return Annotated[kind | None, typer.Option(*flags, show_default=default, **settings)]


def _named(declared: Declared, texts: list[str] | None) -> dict[str, Any] | None:
    """Numbers or ranges of states by name; None where none are given, as for every option."""
    if not texts:
        return None
    if declared.type == Box:
        return {state: ends for state, *ends in map(f.one_range, texts)}
    return console.assignments(texts, declared.name)


def _worded(flag: str, words: tuple[str, str], text: str) -> bool:
    """Whether the second word is given. StickslipError: none of them."""
    if text not in words:
        raise StickslipError(f"{flag} takes {' or '.join(words)}, found '{text}'.")
    return text == words[1]


def summaries() -> dict[str, str]:
    """What each analysis of ours does, by its name; imports none of them, which would take long.

    The declaration, in a line of its own, names the function, whose docstring begins with the summary.
    """
    texts = {}
    for member in ANALYSES.members():
        spec = find_spec(f"{ANALYSES.package}.{member}")
        assert spec is not None and spec.origin is not None
        body = ast.parse(Path(spec.origin).read_text("utf-8")).body
        functions = {node.name: node for node in body if isinstance(node, ast.FunctionDef)}
        for node in body:
            call = node.value if isinstance(node, ast.Assign | ast.AnnAssign) else None
            if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "Analysis":
                words = {keyword.arg: keyword.value for keyword in call.keywords}
                function = functions[words["function"].id]  # type: ignore[attr-defined]
                text = ast.get_docstring(function) or ""
                texts[member] = " ".join(text.split("\n\n")[0].split())
    return texts
