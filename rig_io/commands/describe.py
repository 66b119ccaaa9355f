"""Command that says what the columns of logs are, and writes their sidecar."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.base.figures import check_files

if TYPE_CHECKING:
    from rig_io.description.draft import Draft
    from rig_io.description.questions import Question
    from rig_io.description.runs import DescribedLog

Many = list[str] | None


def describe(
    files: Annotated[list[Path], typer.Argument(metavar="FILES...", help="Logs of one folder, or the folder.")],
    mapped: Annotated[
        Many, typer.Option("--map", metavar="COLUMN=ROLE", help="Role of a column, 'none' for no role; repeat.")
    ] = None,
    units: Annotated[Many, typer.Option("--unit", metavar="COLUMN=UNIT", help="Unit of a column; repeat.")] = None,
    values: Annotated[
        Many,
        typer.Option(
            "--set",
            metavar="NAME=VALUE±U",
            help="J, k, c, R, r, N0, N1, laser, laser_noise, laser_beam, laser_latency, encoder, drive0, drive1, belt, "
            "w:FILE (a drive); repeat.",
        ),
    ] = None,
    uncertainties: Annotated[
        Many, typer.Option("--uncertainty", metavar="NAME=U", help="Standard uncertainty of a --set value; repeat.")
    ] = None,
    kinds: Annotated[
        Many, typer.Option("--kind", metavar="FILE=KIND", help="stick-slip or free-decay; repeat for several.")
    ] = None,
    read: Annotated[
        Many, typer.Option("--read", metavar="OPTION=VALUE", help="How files are written: decimal=comma ...")
    ] = None,
    join: Annotated[
        str | None, typer.Option(metavar="RULE", help="FILES are one run: columns, time, clocks; none: each is one.")
    ] = None,
    answers: Annotated[Path | None, typer.Option(metavar="FILE", help="Answers (.toml) to all questions.")] = None,
    like: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Described logs of the same recorder; nothing is asked.")
    ] = None,
    confirm: Annotated[bool, typer.Option("--confirm", help="What is guessed is right.")] = False,
    reader: Annotated[
        str | None, typer.Option(metavar="FILE", help="Reader for a kind of logs of your own: my_reader.py.")
    ] = None,
    figure: Annotated[
        Path | None, typer.Option("--figure", help="Draw the columns with their roles (png, svg, pdf).")
    ] = None,
    overwrite: console.Overwrite = False,
    json: console.Json = False,
) -> None:
    """Say what the columns of logs are, and write datapackage.json beside them; the logs stay as they are.

    Roles and units are proposed with the reason. What cannot be known is asked, one question at a time, on a terminal;
    elsewhere, as in a notebook, it is listed with the option that gives it.

    Example: stickslip describe my_logs --set 'J=0.0548 ± 0.0003' --set encoder=1000 --map 'Weg=laser'
    """
    from rig_io.description.answers import Answers, from_file, from_options
    from rig_io.description.draft import draft, write

    check_files(figures=[figure], overwrite=overwrite)
    stated = from_options(mapped, units, values, uncertainties, kinds, read, join, confirm)
    stated = stated.over(from_file(answers) if answers is not None else Answers())
    with console.warnings_said(), console.progress("reading") as advance:
        drafted = draft(files, stated, like, reader)
        advance(0.9)
    if figure:
        from fmu_models.base.figures import save_figure
        from rig_io.description.figure import columns_figure

        save_figure(columns_figure(drafted.logs), figure, overwrite=overwrite)
    asking = console.interactive() and not json
    if asking:
        show(drafted, console.console())
        drafted = ask(drafted)
    target = write(drafted)
    content = {"sidecar": str(target), "logs": [_plain(log) for log in drafted.logs], **_open(drafted)}
    content["files"] = [str(figure)] if figure else []
    console.say(json, content, lambda out: finish(drafted, target, not asking, out))


def ask(draft: Draft) -> Draft:
    """Ask what is open, until nothing is; a wrong answer is asked for again, with the reason."""
    from rig_io.description.questions import answered, optional, questions

    out = console.console()
    while open_questions := [*questions(draft), *optional(draft)]:
        question = open_questions[0]
        out.print()
        out.print(console.plain(question.text), soft_wrap=True)
        hint = f"{question.form}; Enter: {question.proposal}" if question.proposal else question.form
        try:
            text = input(f"  [{hint}] > ")
            draft = replace(draft, answers=answered(draft, question, text))
        except EOFError:
            options = "; ".join(_option(question_left) for question_left in open_questions)
            raise StickslipError(
                f"The input ended before all was answered, and nothing was written. Answer by options: {options}; or "
                "by --answers FILE."
            ) from None
        except StickslipError as error:
            out.print(console.plain(f"  {error}"))
            continue
        if question.key == "columns" and text.strip():
            show(draft, out)
    return draft


def show(draft: Draft, out: console.Console) -> None:
    """The columns with their roles."""
    printed: set[tuple[object, ...]] = set()
    for log in draft.logs:
        names = " + ".join(file.path.name for file in log.files)
        kind = f"{log.kind} ({log.kind_reason})" + ("" if log.rule is None else f", joined by {log.rule}")
        signature = tuple((column.name, column.role, column.unit) for file in log.files for column in file.columns)
        out.print(console.plain(f"{names}: {kind}{', columns as above' if signature in printed else ''}", style="bold"))
        if signature in printed:
            continue
        printed.add(signature)
        rows = []
        for file in log.files:
            for column in file.columns:
                sure = f"{100 * column.confidence:.0f} %" if column.role else ""
                unit = f"{column.unit or ''}{' ?' if 'unit' in column.guessed else ''}"
                role = f"{column.role or '-'}{' ?' if 'role' in column.guessed else ''}"
                rows.append([column.name, role, unit, sure, column.reason])
        out.print(console.table("", ("column", "role", "unit", ">sure", "why"), rows))
    for file in (file for log in draft.logs for file in log.files):
        for name, why in file.table.left_out.items():
            out.print(console.plain(f"{file.path.name}: '{name}' is left out: {why}."))


def finish(draft: Draft, target: Path, with_columns: bool, out: console.Console) -> None:
    """Print what was written and what is open."""
    from rig_io.description.questions import optional, questions

    if with_columns:
        show(draft, out)
    out.print(console.plain(f"written: {target}"))
    open_questions = questions(draft)
    for question in open_questions:
        out.print(console.plain(f"Open: {question.text} {_option(question)}"))
    for question in optional(draft):
        out.print(console.plain(f"Not said, and may stay so: {question.text} {_option(question)}"))
    if open_questions:
        out.print("Nobody answers here: give what is open by these options, or all by --answers FILE.")
    else:
        decay_here = any(log.kind == "free-decay" for log in draft.logs) or draft.decay is None
        out.print(console.plain(f"Fit:  stickslip fit {draft.folder}{'' if decay_here else f' {draft.decay}'}"))


def _option(question: Question) -> str:
    """How the command is told."""
    if question.key == "columns":
        return "--confirm, or --map COLUMN=ROLE, --unit COLUMN=UNIT, --kind FILE=KIND"
    return f"--set '{question.key}={question.form.split(' (or ')[0].split(', or ')[0]}'"


def _open(draft: Draft) -> dict[str, Any]:
    from rig_io.description.questions import questions

    open_questions = questions(draft)
    entries = [{"key": q.key, "text": q.text, "form": q.form, "option": _option(q)} for q in open_questions]
    return {"questions": entries, "complete": not open_questions}


def _plain(log: DescribedLog) -> dict[str, Any]:
    """A log as JSON values."""
    files = []
    for file in log.files:
        columns = [
            {
                "name": column.name,
                "role": column.role,
                "unit": column.unit,
                "header_unit": column.header,
                "confidence": round(column.confidence, 2),
                "reason": column.reason,
                "guessed": dict(column.guessed),
            }
            for column in file.columns
        ]
        rows = len(next(iter(file.table.columns.values()), ()))
        left_out = dict(file.table.left_out)
        files.append(
            {"file": str(file.path), "rows": rows, "columns": columns, "left_out": left_out, "notes": file.table.notes}
        )
    return {"name": log.name, "kind": log.kind, "kind_reason": log.kind_reason, "join": log.rule, "files": files}
