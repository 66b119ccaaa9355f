"""Extension points: what a folder of ours holds, what installed packages offer, and what a user names.

    name                    a file of our folder that sets the attribute, or an entry point of an installed package
    my_model.py             a file of the user; the attribute is the one that our files set
    my_model.py:NAME        another attribute of it
    package.module:NAME     of a module, installed or beside

A file or module of the user is run whenever it is named, so that it is never older than its text; it finds the modules
beside it. What it prints goes to standard error, and what it raises is told with its own line. Whether it may run is
for `trust` to say; this is the only place that runs what a text names.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import re
import sys
import traceback
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, redirect_stdout
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Generic, TypeVar

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.files import is_there
from fmu_models.base.trust import FILE, MODULE, check, everything, is_place

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

T = TypeVar("T")
Reference = str | os.PathLike[str]

OURS = "stickslip"  # the origin of members of our folders
_NOT_USERS = {"fmu_models", "rig_io", "identification", *sys.stdlib_module_names}


@dataclass(frozen=True)
class Registry(Generic[T]):
    """The members of one extension point.

    Attributes:
        kind: the word for a member, such as "model".
        package: the folder of ours with one file per member, such as "fmu_models.oscillators".
        attribute: what such a file sets, such as "MODEL".
        group: of the entry points by which installed packages offer members, such as "stickslip.oscillators".
        types: classes a member may be of, "module.Class"; any if empty.
        separator: what stands in a member's name for the underscore of its file's.
    """

    kind: str
    package: str
    attribute: str
    group: str
    types: tuple[str, ...] = ()
    separator: str = "_"

    def members(self) -> list[str]:
        """Names of our own, in the order of the alphabet; imports none."""
        return sorted(self._modules)

    def names(self) -> list[str]:
        """Names of our own and of those that installed packages offer; imports none."""
        return sorted({*self.members(), *(point.name for point in _entry_points(self.group))})

    def origin(self, reference: Reference) -> str:
        """Where a member comes from: `OURS`, the installed package with its version, or what the user named.
        StickslipError: there is none of that name."""
        name = os.fspath(reference)
        if name in self.members():
            return OURS
        if is_place(name):
            return name
        package = self._entry_point(name).dist
        return f"{package.name} {package.version}" if package else self._entry_point(name).value

    def sources(self) -> list[str | bytes]:
        """What the members depend on as their files tell: names and texts of those of our folder, and of those of every
        installed package that offers any; imports none."""
        texts: list[str | bytes] = []
        packages = {self.package}
        for point in sorted(_entry_points(self.group)):
            texts += [point.name, point.value, point.dist.version if point.dist else ""]
            packages.add(point.module.partition(".")[0])
        for package in sorted(packages):
            spec = importlib.util.find_spec(package)
            folders = (spec and spec.submodule_search_locations) or ()
            files = [file for folder in folders for file in sorted(Path(folder).rglob("*.py"))]
            if spec and spec.origin and not folders:
                files.append(Path(spec.origin))
            texts += [text for file in files for text in (str(file), file.read_bytes())]
        return texts

    def load(self, reference: Reference, beside: Path | None = None) -> T:
        """The member that a name, a file or a module stands for.

        Args:
            beside: folder that relative paths and modules start from; the working folder if None.

        Raises:
            StickslipError: there is none, it is of another type, nobody trusts it, or its file fails; with the line in
                the user's file.
        """
        name = os.fspath(reference)
        if name in self._modules:
            return getattr(importlib.import_module(self._modules[name]), self.attribute)
        folder = Path(beside or "").absolute()
        if is_place(name):
            check(name, folder)
        if match := FILE.fullmatch(name):
            module = _run_file(folder / match["file"], self.kind, match["file"])
            return self._taken(module, match["attribute"], match["file"])
        if match := MODULE.fullmatch(name):
            return self._taken(_import(match["module"], folder, self.kind), match["attribute"], match["module"])
        point = self._entry_point(name, folder)
        return self._taken(_import(point.module, None, self.kind), point.attr or None, point.module)

    def running(self, reference: Reference, beside: Path | None = None) -> AbstractContextManager[None]:
        """A context in which a member may be called: what the user's raises is told with its own line, as by `load`."""
        name, folder = os.fspath(reference), Path(beside or "").absolute()
        if name in self.members():
            return nullcontext()
        if not is_place(name):
            return code_of_user(None, self._entry_point(name).module.partition(".")[0])
        check(name, folder)
        if match := FILE.fullmatch(name):
            return code_of_user((folder / match["file"]).parent)
        return code_of_user(folder, name.partition(":")[0].partition(".")[0])

    @property
    def _modules(self) -> dict[str, str]:
        return _members(self.package, self.attribute, self.separator)

    def _entry_point(self, name: str, folder: Path | None = None) -> EntryPoint:
        """The entry point of that name. StickslipError: there is none, or more than one."""
        points = [point for point in _entry_points(self.group) if point.name == name]
        if not points:
            file = f"{name}.py"
            if folder and is_there(folder / file):
                raise StickslipError(f"No {self.kind} is called '{name}'. For the file beside, write {file}.")
            raise StickslipError(f"No {self.kind} is called '{name}'.{nearest(name, self.names())}")
        if len(values := {point.value for point in points}) > 1:
            places = " and ".join(sorted(values))
            raise StickslipError(f"Two packages offer a {self.kind} '{name}': {places}. Name it by one of these.")
        return points[0]

    def _taken(self, module: ModuleType, attribute: str | None, source: str) -> T:
        """A member from its module. StickslipError: the module has no such attribute, or it is of another type."""
        name = attribute or self.attribute
        if not hasattr(module, name):
            others = [name for name, value in vars(module).items() if self.types and self._fits(value)]
            if others:
                hint = f" It has {', '.join(others)}: write {source}:{others[0]}."
            else:
                hint = f" End it with {name} = ..., the {self.kind}." if attribute is None else ""
            raise StickslipError(f"'{source}' defines no {name}.{hint}")
        value = getattr(module, name)
        if self.types and not self._fits(value):
            text = f"the class {value.__name__}" if isinstance(value, type) else f"one of class {type(value).__name__}"
            raise StickslipError(
                f"{name} of '{source}' is no {self.kind}: it must be a {' or '.join(map(_short, self.types))}, "
                f"found {text}."
            )
        return value

    def _fits(self, value: object) -> bool:
        # by name: a value can only be of a class whose module is imported, and listing must not import it
        return any(f"{kind.__module__}.{kind.__qualname__}" in self.types for kind in type(value).__mro__)


def moved(reference: str, beside: Path, to: Path) -> str:
    """A reference that was relative to one folder, for another."""
    match = FILE.fullmatch(reference)
    if not match or Path(match["file"]).is_absolute() or beside.absolute() == to.absolute():
        return reference
    return os.path.relpath(beside / reference, to)


@contextmanager
def code_of_user(folder: Path | None, package: str = "") -> Iterator[None]:
    """Run what a user wrote in a folder, or an installed package: modules of the folder are found, and errors are told
    with the line where they arose there. What it reads in turn is trusted as it is. An installed package alone has no
    folder: no file of the working folder stands in for one of its modules.

    Raises:
        StickslipError: in place of what it raised.
    """
    path, bytecode, before = list(sys.path), sys.dont_write_bytecode, set(sys.modules)
    if folder:
        sys.path.insert(0, str(folder))
    # bytecode is known by its second: a file changed twice within one would be an old one
    sys.dont_write_bytecode = True
    importlib.invalidate_caches()
    try:
        with redirect_stdout(sys.stderr), everything():
            yield
    except (Exception, SystemExit) as error:
        location = _location(error, folder, package)
        if location is None:
            raise
        message = str(error.msg if isinstance(error, SyntaxError) else error)
        kind = "" if isinstance(error, StickslipError) else f"{type(error).__name__}{': ' if message else '.'}"
        raise StickslipError(f"{location}: {kind}{message}") from error
    finally:
        sys.path[:] = path
        sys.dont_write_bytecode = bytecode
        # the next one, perhaps of another folder, shall find its own module of that name, as it is then
        for name in set(sys.modules) - before:
            if folder and _is_in(folder, getattr(sys.modules[name], "__file__", None), name):
                del sys.modules[name]


def _run_file(path: Path, kind: str, name: str) -> ModuleType:
    """A module made from a file of the user. StickslipError: there is no such file, or it fails."""
    try:
        text = path.read_bytes()
    except OSError as error:
        names = [file.name for file in path.parent.glob("*.py")] if path.parent.is_dir() else []
        reason = "does not exist" if isinstance(error, FileNotFoundError) else f"cannot be read: {error.strerror}"
        raise StickslipError(f"The {kind} '{name}' {reason}.{nearest(path.name, names)}") from error
    module = ModuleType(str(path))
    module.__file__ = str(path)
    with code_of_user(path.parent):
        # dataclasses look their module up by its name
        sys.modules[module.__name__] = module
        exec(compile(text, str(path), "exec", dont_inherit=True), vars(module))
    return module


def _import(name: str, folder: Path | None, kind: str) -> ModuleType:
    """A module by its name, of a folder or installed; None: installed alone. StickslipError: there is none, or it
    fails."""
    with code_of_user(folder, name.partition(".")[0]):
        try:
            return importlib.import_module(name)
        except ModuleNotFoundError as error:
            if error.name and f"{name}.".startswith(f"{error.name}."):
                missing = f"neither in '{folder}' nor installed" if folder else "not installed"
                raise StickslipError(f"The {kind} is to come from a module '{name}', which is {missing}.") from None
            raise


def _location(error: BaseException, folder: Path | None, package: str) -> str | None:
    """File and line that an error arose in, in a folder or a package; None if in neither."""
    if isinstance(error, SyntaxError) and error.filename and Path(error.filename).is_file():
        return f"{_short_path(error.filename)}, line {error.lineno}"
    location = None
    for frame, line in traceback.walk_tb(error.__traceback__):
        file, module = frame.f_code.co_filename, frame.f_globals.get("__name__", "")
        if (folder and _is_in(folder, file, module)) or (package and module.partition(".")[0] == package):
            location = f"{_short_path(file)}, line {line}"
    return location


def _is_in(folder: Path, file: str | None, module: str) -> bool:
    """Whether a module's file is of a folder: not ours, not Python's, not of a package installed beneath it."""
    if file is None or not Path(file).is_relative_to(folder) or module.partition(".")[0] in _NOT_USERS:
        return False
    return "site-packages" not in Path(file).relative_to(folder).parts


def _short_path(file: str) -> str:
    """A path as the user would write it."""
    path = Path(file)
    return str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)


def _short(name: str) -> str:
    return name.rpartition(".")[2]


def _entry_points(group: str) -> Sequence[EntryPoint]:
    """Entry points of the installed packages, as they are now."""
    from importlib import metadata  # takes a tenth of the start of a command that needs none

    return tuple(metadata.entry_points(group=group))


@cache
def _members(package: str, attribute: str, separator: str) -> dict[str, str]:
    """Modules of a package that set an attribute, by the names of their members; imports none of them."""
    spec = importlib.util.find_spec(package)
    sets = re.compile(rf"^{attribute}\b\s*[:=]", re.MULTILINE)
    folders = map(Path, (spec and spec.submodule_search_locations) or ())
    files = [path for folder in folders for path in folder.glob("*.py") if sets.search(path.read_text("utf-8"))]
    return {path.stem.replace("_", separator): f"{package}.{path.stem}" for path in files}
