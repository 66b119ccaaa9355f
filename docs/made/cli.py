"""Reference of the shell: every command with its arguments, options and examples, as typer knows them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import typer

from fmu_models.analyses.declaration import ANALYSES
from identification.commands.application import FITS, MODELS, RIG, whole

GROUPS = (
    ("Models, FMUs and scenes", set(MODELS)),
    ("Families of motions", set(ANALYSES.members())),
    ("Friction and rigs", {*RIG, *FITS}),
)


def pages() -> Iterator[tuple[str, str]]:
    """One page with all of them, in the groups of the application."""
    program: Any = typer.main.get_command(whole())
    commands = dict(program.commands)
    text = ["# Commands", _plain(program.help or ""), _table(program, "stickslip", "option")]
    for title, own in GROUPS:
        text.append(f"## {title}")
        text += [_command(name, commands.pop(name)) for name in sorted(own & commands.keys())]
    text.append("## Maps, new files, what comes along")
    text += [_command(name, commands[name]) for name in sorted(commands)]
    yield "reference/commands.md", "\n\n".join(text) + "\n"


def _command(name: str, command: Any) -> str:
    text, examples = _help(command.help or "")
    parts = [f"### stickslip {name}", text]
    if examples:
        parts.append("```sh\n" + "\n".join(examples) + "\n```")
    parts += [_table(command, name, kind) for kind in ("argument", "option")]
    parts += [_command(f"{name} {inner}", one) for inner, one in sorted(getattr(command, "commands", {}).items())]
    return "\n\n".join(part for part in parts if part)


def _help(text: str) -> tuple[str, list[str]]:
    """What a command says of itself, and the lines of its examples."""
    paragraphs = re.split(r"\n\s*\n", text)
    examples = [" ".join(one.split())[9:] for one in paragraphs if one.startswith("Example: ")]
    return "\n\n".join(_plain(one) for one in paragraphs if not one.startswith("Example: ")), examples


def _table(command: Any, name: str, kind: str) -> str:
    """The arguments or the options of a command, as its own help tells them."""
    context = command.context_class(command, info_name=name)
    said = [p.get_help_record(context) for p in command.params if p.param_type_name == kind]
    rows = [f"| `{_bar(names)}` | {_bar(_plain(meaning))} |" for names, meaning in filter(None, said)]
    return "\n".join([f"| {kind} | meaning |", "|---|---|", *rows]) if rows else ""


def _bar(text: str) -> str:
    return text.replace("|", "\\|")


def _plain(text: str) -> str:
    """Help as a paragraph of Markdown: what looks like markup there is none."""
    words = " ".join(text.split())
    words = re.sub(r"([*_<>\[\]$])", r"\\\1", words)
    return re.sub(r"(?<!\S)(--?[a-z][\w-]*)", r"`\1`", words)
