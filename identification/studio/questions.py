"""The questions on logs as a form: what is guessed is filled in, and answers are kept in a file beside the logs."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fmu_models.base.errors import StickslipError
from fmu_models.base.files import write_whole
from rig_io.description.answers import KINDS, NONE, Answers, from_file
from rig_io.description.draft import Draft, draft
from rig_io.description.figure import columns_figure
from rig_io.description.questions import COLUMNS_RIGHT, Question, answered, optional, questions
from rig_io.logs.columns import COLUMNS

ANSWERS = "answers.toml"


@dataclass(frozen=True)
class Asked:
    """columns: (name, role, unit, why) of the logs; kinds: kind of experiment by file; questions: what else is open;
    faults: sentences on what was wrong in the answers."""

    folder: str
    columns: tuple[tuple[str, str, str, str], ...]
    kinds: Mapping[str, str]
    questions: tuple[Question, ...]
    faults: tuple[str, ...] = ()

    @property
    def roles(self) -> tuple[str, ...]:
        """What a column may be."""
        return (NONE, *COLUMNS)

    @property
    def all_kinds(self) -> tuple[str, ...]:
        """What a log may be."""
        return KINDS


class Drafts:
    """Logs as they were read last, until a file of their folder changes."""

    def __init__(self) -> None:
        self._last: tuple[object, Draft] | None = None

    def of(self, study: Path, folder: str) -> Draft:
        """The logs of a folder in a study, with what was answered before. StickslipError: as ``draft``."""
        marks = _marks(study / folder)
        if self._last is None or self._last[0] != marks:
            file = study / folder / ANSWERS
            self._last = marks, draft([study / folder], from_file(file) if file.exists() else Answers())
        return self._last[1]

    def answered(self, study: Path, folder: str, made: Draft, answers: Answers) -> Draft:
        """The same logs with other answers, which are kept beside them."""
        keep(answers, study / folder)
        self._last = _marks(study / folder), replace(made, answers=answers)
        return self._last[1]


def _marks(folder: Path) -> list[tuple[Path, int, int]]:
    """Marks by which a change of a folder is known."""
    return [(path, stat.st_mtime_ns, stat.st_size) for path in sorted(folder.iterdir()) if (stat := path.stat())]


def asked(made: Draft, folder: str, faults: tuple[str, ...] = ()) -> Asked:
    """What a form asks of logs."""
    columns: dict[str, tuple[str, str, str, str]] = {}
    for column in (column for log in made.logs for file in log.files for column in file.columns):
        columns.setdefault(column.name, (column.name, column.role or NONE, column.unit or "", column.reason))
    kinds = {file.path.name: log.kind for log in made.logs for file in log.files}
    open_ = [question for question in (*questions(made), *optional(made)) if question.key != COLUMNS_RIGHT]
    return Asked(folder, tuple(columns.values()), kinds, tuple(open_), faults)


def answer(made: Draft, form: Mapping[str, str]) -> tuple[Answers, tuple[str, ...]]:
    """The answers of a form, with fields "role NAME", "unit NAME", "kind FILE" and "value KEY"; and what is wrong."""
    before = asked(made, "")
    changes = []
    for name, role, unit, _ in before.columns:
        said, of = form.get(f"role {name}", role), form.get(f"unit {name}", unit).strip()
        if (said, of) != (role, unit):
            changes.append(f"{name}={said} {of if said != NONE else ''}".strip())
    changes += [f"{file}={form.get(f'kind {file}', kind)}" for file, kind in before.kinds.items()]
    faults, answers = [], made.answers
    right = Question(COLUMNS_RIGHT, "", "")
    texts = {question: form.get(f"value {question.key}", "") for question in before.questions}
    for question, text in {right: "; ".join(changes), **texts}.items():
        now = Draft(made.tables, made.known, made.example, made.like, answers, made.decay)
        try:
            answers = answered(now, question, text) if text.strip() or question.proposal else answers
        except StickslipError as error:
            faults.append(str(error))
    return answers, tuple(faults)


def keep(answers: Answers, folder: Path) -> Path:
    """Write answers into a folder of logs, as ``describe --answers`` reads them."""
    columns = {name: f"{role} {answers.units.get(name, '')}".strip() for name, role in answers.columns.items()}
    tables: dict[str, Mapping[str, Any]] = {
        "columns": columns,
        "values": answers.values,
        "kinds": answers.kinds,
        "read": answers.read,
    }
    lines = [f"confirm = {json.dumps(answers.confirm)}"]
    lines += [f"join = {json.dumps(answers.join)}"] if answers.join else []
    for table, entries in tables.items():
        lines += ["", f"[{table}]"] if entries else []
        lines += [f"{_quoted(name)} = {_quoted(value)}" for name, value in entries.items()]
    with write_whole(folder / ANSWERS, overwrite=True) as temporary:
        temporary.write_text("\n".join(lines) + "\n", "utf-8")
    return folder / ANSWERS


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def picture(made: Draft) -> str:
    """The columns over the rows, as SVG."""
    import io

    text = io.StringIO()
    columns_figure(made.logs).savefig(text, format="svg")
    return text.getvalue()
