"""Reading data runs no code.

A document (a fit, a scene, a system, the state of a watch) may name code: `my_law.py`, `package.module:NAME`, or an FMU
outside its own folder. Who opens it has not written that name. It is refused unless the user

    named that very file, on the command line or by a call that loaded it in this process;
    said ``--trust``, in Python ``trust=True``;

or it came along with the suite. Members of our folders and entry points of installed packages are names, not places:
they need no trust, for whoever installed them has let them run.

    admit    each reader of documents, for each reference that it holds, before anything is loaded
    check    the registry, before it runs a place: while a command runs, only what is named or admitted, so that a
             document that nobody has thought of runs nothing either; in a program, a call with a place names it

The record is the process's. A value handed down would widen thirty signatures and be lost where a reference goes
through a fit; a context variable would not reach the threads that load models. What has run once in a process may have
left anything there, so that trust in it cannot be narrower than the process.
"""

import os
import re
import shlex
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from fmu_models.base import shipped
from fmu_models.base.errors import StickslipError

FILE = re.compile(r"(?P<file>.+\.py)(:(?P<attribute>\w+))?")
MODULE = re.compile(r"(?P<module>[\w.]+):(?P<attribute>\w+)")
NATIVE = ".fmu"
OURS = ("fmu_models", "identification", "rig_io")


@dataclass
class _Process:
    """named: identities of what the user named or trusts; command: the arguments of the command that runs, None in a
    program; everything: whether all is trusted."""

    named: set[str] = field(default_factory=set)
    command: tuple[str, ...] | None = None
    everything: bool = False

    def trusts(self, identity: str) -> bool:
        came_along = Path(identity).is_relative_to(shipped.folder().resolve())
        return self.everything or came_along or identity in self.named


_process = _Process()


def is_place(reference: str | os.PathLike[str]) -> bool:
    """Whether a reference is a file or a module, not the name of a member."""
    name = os.fspath(reference)
    return bool(FILE.fullmatch(name) or MODULE.fullmatch(name))


def admit(reference: str, folder: Path, *, trust: bool = False) -> None:
    """Judge a reference that a document holds; folder: which its relative paths start from. StickslipError: it names
    code that the user has not named and does not trust; the caller says in which document."""
    outside = reference.lower().endswith(NATIVE) and not _resolved(reference, folder).is_relative_to(folder.resolve())
    if not (outside or is_place(reference)):
        return
    identity = _identity(reference, folder)
    if not (trust or _process.trusts(identity)):
        code = "the FMU" if outside else "the Python file" if FILE.fullmatch(reference) else "the Python module"
        where = ", which is outside its folder" if outside else ""
        raise StickslipError(
            f"it names {code} '{reference}'{where}: reading data runs no code. Look at what it does. {_line()}"
        )
    _process.named.add(identity)


def check(reference: str, folder: Path) -> None:
    """Let a place be run that was named or admitted; a program names it by the call. StickslipError: a command runs,
    and it was neither."""
    identity = _identity(reference, folder)
    if _process.command is not None and not _process.trusts(identity):
        raise StickslipError(f"'{reference}' is code that the command line does not name. {_line()}")
    _process.named.add(identity)


@contextmanager
def everything() -> Iterator[None]:
    """Trust what documents name, as ``--trust`` does."""
    before, _process.everything = _process.everything, True
    try:
        yield
    finally:
        _process.everything = before


@contextmanager
def command_line(arguments: Sequence[str]) -> Iterator[None]:
    """While a command runs: what its arguments name is named by the user, and no place runs that nobody named."""
    global _process
    before = _process
    words = (word for argument in arguments for word in (argument, *re.split("[=,]", argument)))
    named = {_identity(word, Path()) for word in words if is_place(word) or word.lower().endswith(NATIVE)}
    _process = replace(before, named={*before.named, *named}, command=tuple(arguments))
    try:
        yield
    finally:
        _process = before


def _identity(reference: str, folder: Path) -> str:
    """One text for one piece of code, however it is named: a file without its links, or a module and where it is
    looked for."""
    if (module := MODULE.fullmatch(reference)) and not FILE.fullmatch(reference):
        if _is_ours(module["module"]):
            return str(shipped.folder().resolve() / module["module"])
        return f"{folder.resolve()}:{module['module']}"
    file = FILE.fullmatch(reference)
    return str(_resolved(file["file"] if file else reference, folder))


def _is_ours(module: str) -> bool:
    """Whether a module is of a package of the suite, which has been imported from where the suite is."""
    package = sys.modules.get(name := module.partition(".")[0])
    return name in OURS and getattr(package, "__path__", [""])[0] == str(shipped.ROOM / name)


def _resolved(reference: str, folder: Path) -> Path:
    return (folder / reference).resolve()


def _line() -> str:
    """The words to add to a command to trust it."""
    if _process.command is None:
        return "If you trust it, say trust=True where you read it."
    return f"If you trust it:\n  stickslip {shlex.join(_process.command)} --trust"
