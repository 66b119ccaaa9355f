"""Files that are written whole or not at all."""

from __future__ import annotations

import errno
import hashlib
import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from fmu_models.base import shipped
from fmu_models.base.errors import StickslipError, WriteError, nearest

# what a disk says that takes no more: no room, a quota, a largest size, a fault of its own
FULL = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO})

OVERWRITE = "Choose another name, or have it replaced: --overwrite (in Python overwrite=True)."


def existing(path: str | os.PathLike[str], what: str = "file", advice: str = "") -> Path:
    """The path, if something is there.

    Raises:
        StickslipError: nothing is; ``what`` is the word for it, ``advice`` on how to get one, with a space before it.
    """
    given = Path(path)
    if not is_there(given):
        raise StickslipError(f"There is no {what} '{path}'.{shipped.hint(given) or advice}")
    return given


def named_file(path: str | os.PathLike[str], known: Iterable[Path], what: str) -> Path:
    """A file given by its path, or by the name (with or without ending) of one of those that come along.

    Raises:
        StickslipError: there is none; ``what`` is the word for such a file.
    """
    given = Path(path)
    if is_there(given) and given.is_file():
        return given
    by_name = {file.stem: file for file in known}
    stem = given.stem if given.suffix in {file.suffix for file in by_name.values()} else str(given)
    if given.parent == Path() and stem in by_name:
        return by_name[stem]
    raise StickslipError(f"There is no {what} '{path}'.{shipped.hint(given) or nearest(stem, by_name)}")


def is_there(path: Path) -> bool:
    """Whether something is; a name that no file can have (too long, say) names nothing."""
    try:
        return path.exists()
    except OSError:
        return False


def refuse_existing(*paths: str | os.PathLike[str] | None, overwrite: bool = False) -> None:
    """Refuse files that exist: before the work rather than after it. None stands for a file that is not asked for.

    Raises:
        StickslipError: one of them exists and ``overwrite`` is false.
    """
    for path in paths:
        if path is not None and not overwrite and is_there(Path(path)):
            raise StickslipError(f"'{path}' exists already. {OVERWRITE}")


@contextmanager
def write_whole(path: str | os.PathLike[str], *, overwrite: bool = False) -> Iterator[Path]:
    """Yield a temporary path beside ``path``; rename it to ``path`` on success, remove it on failure.

    Raises:
        StickslipError: ``path`` exists and ``overwrite`` is false, or its folder cannot be written.
        WriteError: the disk is full.
    """
    target = Path(path)
    refuse_existing(target, overwrite=overwrite)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{target.stem}-", suffix=target.suffix, dir=target.parent)
    except OSError as error:
        if error.errno in FULL:
            raise disk_error(error, target) from error
        raise StickslipError(
            f"'{target}' cannot be written: {error.strerror}. Choose a folder you may write to."
        ) from error
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o666 & ~_umask())
        os.replace(temporary, target)
    except OSError as error:
        if error.errno in FULL:
            raise disk_error(error, target) from error
        raise
    finally:
        temporary.unlink(missing_ok=True)


def disk_error(error: OSError, what: str | os.PathLike[str]) -> WriteError:
    """What to say where a disk takes no more."""
    return WriteError(f"'{what}' cannot be written: {error.strerror}. Make room, or write to another place.")


def seal(path: Path) -> None:
    """Keep the hash of a file beside it."""
    with write_whole(_seal_of(path), overwrite=True) as temporary:
        temporary.write_text(_sha256(path), "ascii")


def is_sealed(path: Path) -> bool:
    """Whether a file is there and is, to the last bit, the one that was sealed."""
    try:
        return _seal_of(path).read_text("ascii") == _sha256(path)
    except (OSError, UnicodeDecodeError):
        return False


def _seal_of(path: Path) -> Path:
    return path.with_name(f"{path.name}.sha256")


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _umask() -> int:
    """The process's file mode mask; the only portable way to read it is to set it."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
