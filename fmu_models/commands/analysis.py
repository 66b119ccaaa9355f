"""The command of an analysis, derived from its declaration."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

import typer

from fmu_models.analyses.declaration import ANALYSES, VALUES, Declared
from fmu_models.base import console
from fmu_models.commands import families as f
from fmu_models.commands.bundles import Without, bundled

COUNTS = {VALUES: 1, "parameters": 2}


def command_of(name: str) -> Callable[..., None]:
    """The command of an analysis as typer reads it: axes, section, its own options, who makes the runs, files."""
    analysis = ANALYSES.load(name)
    files: Any = f.StoredFiles if analysis.stores else f.Files
    parts: dict[str, Any] = {
        "section": Annotated[f.Section, Without(*analysis.without)],
        **{declared.name: _option(declared) for declared in analysis.options.values()},
        "runs": f.Runs,
        "files": files if analysis.page else Annotated[files, Without("interactive")],
    }
    if analysis.axes:
        parts = {"over": f.Ranges, **parts}
    if not analysis.stores:
        del parts["runs"]

    def command(**given: Any) -> None:
        section, files = given.pop("section"), given.pop("files")
        arguments = {"execution": given.pop("runs").execution(files)} if analysis.stores else {}
        files.check()
        axes = section.axes(name, given.pop("over"), COUNTS.get(analysis.axes)) if analysis.axes else {}
        options = section.options(name, **given)
        system = section.system()
        with console.progress(analysis.label) as advance:
            result = analysis.run(system, axes, start=section.starts(), **options, **arguments, progress=advance)
        files.tell(result, result.record(), section if analysis.page else None)

    command.__name__ = name
    command.__doc__ = f"{analysis.summary}\n\nExample: stickslip {name} {analysis.example}"
    command.__annotations__ = parts
    defaulted = {"over", *analysis.options}
    parameters = [
        inspect.Parameter(
            name, inspect.Parameter.KEYWORD_ONLY, default=None if name in defaulted else inspect.Parameter.empty
        )
        for name in parts
    ]
    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined] # what typer reads
    return console.trusting(bundled(command))


def _option(declared: Declared) -> Any:
    """Not given, the shell's option is None: then a scene, or the function's own default, says it."""
    option = declared.option
    flags = (f"--{option.flag}",) if option.flag else ()
    shown = option.default or str(declared.default)
    return Annotated[
        declared.type | None, typer.Option(*flags, help=option.help, min=option.minimum, show_default=shown)
    ]


def summaries() -> dict[str, str]:
    """What each analysis of ours does, by its name; imports none of them, which would take long.

    The declaration names the function, whose docstring begins with the summary.
    """
    found = {}
    for member in ANALYSES.members():
        spec = find_spec(f"{ANALYSES.package}.{member}")
        assert spec is not None and spec.origin is not None
        tree = ast.parse(Path(spec.origin).read_text("utf-8"))
        functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Analysis":
                words = {one.arg: one.value for one in node.keywords}
                function = functions[words["function"].id]  # type: ignore[attr-defined]
                text = ast.get_docstring(function) or ""
                found[member] = " ".join(text.split("\n\n")[0].split())
    return found
