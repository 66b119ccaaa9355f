"""A study: a folder of logs, models and results, and the commands that were given there.

`study.toml` lists them, in order:

    [[step]]
    run = ["fit", "logs", "--result", "fit.json"]
"""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fmu_models.base.errors import StickslipError
from fmu_models.base.files import existing, write_whole
from fmu_models.base.toml_document import Document, read_document
from fmu_models.base.trust import admit

STUDY = "study.toml"
HEAD = "# The commands that were given here, in order. Again: stickslip run study.toml\n"
# what does not end by itself, or gives commands of its own
NO_STEPS = frozenset({"studio", "run", "watch", "docs"})
CALL = "from identification.cli import main; main()"


def line(arguments: Sequence[str]) -> str:
    """The command line of a step, as it is typed."""
    return shlex.join(("stickslip", *arguments))


def begun(arguments: Sequence[str], folder: Path, **pipes: object) -> subprocess.Popen[str]:
    """The command of a step, in a process of its own; it answers no questions."""
    command = [sys.executable, "-c", CALL, *arguments]
    return subprocess.Popen(command, cwd=folder, stdin=subprocess.DEVNULL, text=True, **pipes)  # type: ignore[call-overload, no-any-return]


@dataclass(frozen=True)
class Study:
    """A document and its steps, the arguments of a command each."""

    file: Path
    steps: tuple[tuple[str, ...], ...]

    @property
    def folder(self) -> Path:
        """Where its commands run."""
        return self.file.resolve().parent

    def check(self, *, trust: bool) -> None:
        """Raises StickslipError: a step names code, or a place outside the folder, that the user does not trust."""
        for number, step in enumerate(self.steps, 1):
            for word in (word for argument in step for word in (*re.split("[=,]", argument), argument)):
                try:
                    admit(word, self.folder, trust=trust)
                except StickslipError as error:
                    raise StickslipError(f"{self.file}, step {number}: {error}") from error
                if not trust and not (self.folder / word).resolve().is_relative_to(self.folder):
                    raise StickslipError(
                        f"{self.file}, step {number}: '{word}' lies outside of its folder, and a step may write. Look "
                        f"at what it does: {line(step)}. If you trust it, add --trust."
                    )


def read_study(file: Path) -> Study:
    """A study. StickslipError: no such file, or what is wrong in it, with its line."""
    document = read_document(existing(file, "study"))
    document.check_keys(("step",))
    return Study(file, tuple(_step(document, i, entry) for i, entry in enumerate(document.entries("step"))))


def _step(document: Document, i: int, entry: dict[str, Any]) -> tuple[str, ...]:
    document.check_keys(("run",), "step", i)
    run = entry.get("run")
    if not (isinstance(run, list) and run and all(isinstance(word, str) for word in run)):
        raise document.fault('a step holds one command: run = ["simulate", "block_on_belt"]', "step", i)
    if run[0] in NO_STEPS:
        raise document.fault(f"'{run[0]}' cannot be a step: it has no end, or gives commands itself.", "step", i, "run")
    return tuple(run)


def add_step(file: Path, arguments: Sequence[str]) -> None:
    """Write one more step at the end of a study; the rest of it stays as it is."""
    text = file.read_text("utf-8") if file.exists() else HEAD
    entry = f"\n[[step]]\nrun = {json.dumps(list(arguments), ensure_ascii=False)}\n"
    with write_whole(file, overwrite=True) as temporary:
        temporary.write_text(text.rstrip("\n") + "\n" + entry, "utf-8")
