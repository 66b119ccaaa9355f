"""Files that are written whole or not at all."""

import errno
import hashlib
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from fmu_models.base import shipped
from fmu_models.base.errors import StickslipError, WriteError, nearest
from fmu_models.base.temporary import claim_folder, release_folder

# what a disk says that takes no more: no room, a quota, a largest size, a fault of its own
FULL = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO})

OVERWRITE = "Choose another name, or have it replaced: --overwrite (in Python overwrite=True)."


def existing(path: str | os.PathLike[str], kind: str = "file", advice: str = "") -> Path:
    """The path, if something is there. StickslipError: nothing is; ``kind`` is the word for it, ``advice`` on how to
    get one, with a space before it."""
    target = Path(path)
    if not is_there(target):
        raise StickslipError(f"There is no {kind} '{path}'.{shipped.hint(target) or advice}")
    return target


def named_file(path: str | os.PathLike[str], files: Iterable[Path], kind: str) -> Path:
    """A file given by its path, or by the name (with or without ending) of one of those that come along.
    StickslipError: there is none; ``kind`` is the word for such a file."""
    target = Path(path)
    if is_there(target) and target.is_file():
        return target
    by_name = {file.stem: file for file in files}
    stem = target.stem if target.suffix in {file.suffix for file in by_name.values()} else str(target)
    if target.parent == Path() and stem in by_name:
        return by_name[stem]
    raise StickslipError(f"There is no {kind} '{path}'.{shipped.hint(target) or nearest(stem, by_name)}")


def is_there(path: Path) -> bool:
    """Whether something is; a name that no file can have (too long, say) names nothing."""
    try:
        return path.exists()
    except OSError:
        return False


def refuse_existing(*paths: str | os.PathLike[str] | None, overwrite: bool = False) -> None:
    """Refuse files that exist: before the work rather than after it. None stands for a file that is not asked for.
    StickslipError: one of them exists and ``overwrite`` is false."""
    for path in paths:
        if path is not None and not overwrite and is_there(Path(path)):
            raise StickslipError(f"'{path}' exists already. {OVERWRITE}")


def checked_page(path: str | os.PathLike[str], *, overwrite: bool) -> Path:
    """The path, if a page can be written there; before the work. StickslipError: another suffix; or it exists and
    ``overwrite`` is false."""
    if Path(path).suffix.lower() not in (".html", ".htm"):
        raise StickslipError(f"'{path}' is to be a page: end it in .html.")
    refuse_existing(path, overwrite=overwrite)
    return Path(path)


@contextmanager
def write_whole(path: str | os.PathLike[str], *, overwrite: bool = False) -> Iterator[Path]:
    """Yield a path in a temporary folder beside ``path``; rename it to ``path`` on success, remove it on failure.

    Raises:
        StickslipError: ``path`` exists and ``overwrite`` is false, or its folder cannot be written.
        WriteError: the disk is full.
    """
    target = Path(path)
    refuse_existing(target, overwrite=overwrite)
    with on_disk(target):
        target.parent.mkdir(parents=True, exist_ok=True)
        folder = claim_folder("write", target.parent)
    try:
        yield folder / target.name
        os.replace(folder / target.name, target)
    except OSError as error:
        if error.errno in FULL:
            raise disk_error(error, target) from error
        raise
    finally:
        release_folder(folder)


@contextmanager
def on_disk(path: str | os.PathLike[str]) -> Iterator[None]:
    """Say what a disk says that takes no more, or a folder that nobody may write to."""
    try:
        yield
    except OSError as error:
        if error.errno in FULL:
            raise disk_error(error, path) from error
        raise StickslipError(
            f"'{path}' cannot be written: {error.strerror}. Choose a folder you may write to."
        ) from error


def disk_error(error: OSError, path: str | os.PathLike[str]) -> WriteError:
    """The error of a disk that takes no more."""
    return WriteError(f"'{path}' cannot be written: {error.strerror}. Make room, or write to another place.")


def seal(path: Path) -> None:
    """Keep the hash of a file beside it."""
    with write_whole(_seal_of(path), overwrite=True) as temporary:
        temporary.write_text(sha256(path), "ascii")


def is_sealed(path: Path) -> bool:
    """Whether a file is there and is, to the last bit, the one that was sealed."""
    try:
        return _seal_of(path).read_text("ascii") == sha256(path)
    except (OSError, UnicodeDecodeError):
        return False


def sealed_bytes(path: Path, make: Callable[[], bytes]) -> bytes:
    """The contents of a sealed file, made anew where there is none or it is damaged; kept if it can be."""
    if is_sealed(path):
        return path.read_bytes()
    contents = make()
    with suppress(StickslipError):
        with write_whole(path, overwrite=True) as temporary:
            temporary.write_bytes(contents)
        seal(path)
    return contents


def sealed_text(path: Path, make: Callable[[], str]) -> str:
    """As ``sealed_bytes``, for a text."""
    return sealed_bytes(path, lambda: make().encode()).decode()


def stamps(folder: str | os.PathLike[str]) -> Iterator[str]:
    """Path, size and time of each file in a folder and below it, but of those that Python compiled."""
    for entry in os.scandir(folder):
        if entry.is_dir():
            yield from stamps(entry.path)
        elif not entry.name.endswith(".pyc"):
            yield f"{entry.path}\n{entry.stat().st_size} {entry.stat().st_mtime_ns}"


def _seal_of(path: Path) -> Path:
    return path.with_name(f"{path.name}.sha256")


def sha256(path: Path) -> str:
    """Hash of a file of any size."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
