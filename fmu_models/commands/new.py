"""Commands that write a small file to begin with, and its test."""

from __future__ import annotations

import json as json_files
import keyword
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.base.files import refuse_existing, write_whole
from fmu_models.base.trust import is_place
from fmu_models.commands.arguments import Model

app = console.app("Write a small file to begin with, which runs as it is, and its test.")

Name = Annotated[str, typer.Argument(metavar="NAME", help="Its name, also of its file: letters, digits, underscores.")]


@app.command()
def model(name: Name, overwrite: console.Overwrite = False, json: console.Json = False) -> None:
    """Write a model, NAME.py, and its test.

    Example: stickslip new model my_rig
    """
    name = _checked(name)
    following = f"stickslip simulate {name}.py"
    _write({"model.py": f"{name}.py", "test_model.py": f"test_{name}.py"}, {"name": name}, following, overwrite, json)


@app.command()
def law(name: Name, overwrite: console.Overwrite = False, json: console.Json = False) -> None:
    """Write a friction law, NAME.py, and its test.

    Example: stickslip new law my_law
    """
    name = _checked(name)
    values = {"name": name, "kind": "".join(word[:1].upper() + word[1:] for word in name.split("_"))}
    following = f"stickslip fit LOGS --law {name}.py"
    _write({"law.py": f"{name}.py", "test_law.py": f"test_{name}.py"}, values, following, overwrite, json)


@app.command()
def scene(model: Model, overwrite: console.Overwrite = False, json: console.Json = False) -> None:
    """Write a scene of a model, with all that it has at its defaults, and its test.

    Example: stickslip new scene disc_rig
    """
    from fmu_models.language.mechanism import Mechanism
    from fmu_models.lowering.lower import lower
    from fmu_models.oscillators import MODELS

    declared = MODELS.load(model)
    system = lower(declared)
    name = f"{declared.name}_scene"
    values = {
        "file": f"{name}.toml",
        # of a model of one's own: the scene names a file
        "trust": ", trust=True" if is_place(model) else "",
        "title": json_files.dumps(declared.title),
        "reference": json_files.dumps(model),
        # the switches of an automaton are no choice
        "contacts": _quoted(c.name for c in declared.contacts if isinstance(declared, Mechanism)),
        "outputs": _quoted(output.name for output in declared.outputs),
        "parameters": system.parameters,
        "inputs": system.inputs,
        "states": system.states,
    }
    following = f"stickslip scene {name}.toml{' --trust' if is_place(model) else ''}"
    _write({"scene.toml": f"{name}.toml", "test_scene.py": f"test_{name}.py"}, values, following, overwrite, json)


def _checked(name: str) -> str:
    """A name of a file and of what it declares. StickslipError: it cannot be one."""
    name = name.removesuffix(".py")
    if not re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII) or keyword.iskeyword(name):
        raise StickslipError(
            f"'{name}' cannot be a name. Begin with a letter, and use letters, digits and underscores: my_rig."
        )
    return name


def _quoted(names: Iterable[str]) -> str:
    return ", ".join(json_files.dumps(name) for name in names)


def _write(templates: dict[str, str], values: dict[str, Any], following: str, overwrite: bool, as_json: bool) -> None:
    """Fill templates into files of the working folder, and say what to do with them."""
    import jinja2

    refuse_existing(*templates.values(), overwrite=overwrite)
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("fmu_models.commands"),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=jinja2.StrictUndefined,
    )
    texts = {file: environment.get_template(f"{name}.j2").render(values) for name, file in templates.items()}
    for file, text in texts.items():
        with write_whole(Path(file), overwrite=overwrite) as temporary:
            temporary.write_text(text, encoding="utf-8")

    def show(out: console.Console) -> None:
        console.print_files(texts, out)
        out.print(f"Use it:   {following}")
        out.print(f"Test it:  python -m pytest {list(texts)[-1]}")

    console.say(as_json, {"files": list(texts), "next": following}, show)
