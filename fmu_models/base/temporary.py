"""Temporary folders that do not outlive their process for long, even where it is killed.

    .stickslip-<kind>-<random>/
      lock       held as long as the process that made the folder lives; the system lets go of it
      content/   what is worked in

The first such folder that a process makes somewhere removes those there whose lock nobody holds. A lock comes into
being held, under another name, so that no folder is ever seen without its owner.
"""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows, where an open file cannot be removed and is its own lock
    fcntl = None

PREFIX = ".stickslip-"
_held: dict[Path, int] = {}
_swept: set[Path] = set()


@contextmanager
def temporary_folder(kind: str, parent: Path | None = None) -> Iterator[Path]:
    """A folder to work in, removed afterwards; in ``parent``, or where temporary files go."""
    folder = claim_folder(kind, parent)
    try:
        yield folder
    finally:
        release_folder(folder)


def claim_folder(kind: str, parent: Path | None = None) -> Path:
    """A folder as of ``temporary_folder``, to be removed by ``release_folder``."""
    root = Path(tempfile.gettempdir()) if parent is None else parent
    if root not in _swept:
        _swept.add(root)
        _sweep(root)
    outer = Path(tempfile.mkdtemp(prefix=f"{PREFIX}{kind}-", dir=root))
    content = outer / "content"
    try:
        lock = os.open(outer / "new", os.O_CREAT | os.O_RDWR)
        _held[content] = lock
        if fcntl:
            with suppress(OSError):  # where a file system has no locks, what a killed process leaves stays
                fcntl.flock(lock, fcntl.LOCK_EX)
                os.rename(outer / "new", outer / "lock")
        content.mkdir()
    except BaseException:
        release_folder(content)
        raise
    return content


def release_folder(folder: Path) -> None:
    """Remove a folder that was claimed; what cannot be removed stays."""
    lock = _held.pop(folder, None)
    shutil.rmtree(folder, ignore_errors=True)
    if lock is not None:
        os.close(lock)
    shutil.rmtree(folder.parent, ignore_errors=True)


def _sweep(root: Path) -> None:
    """Remove the folders of processes that are no more; whose folder cannot be looked at is alive."""
    for outer in root.glob(f"{PREFIX}*"):
        with suppress(OSError):
            if outer.is_symlink():
                continue
            if fcntl is None:
                (outer / "new").unlink()
                shutil.rmtree(outer, ignore_errors=True)
                continue
            lock = os.open(outer / "lock", os.O_RDWR)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(outer, ignore_errors=True)
            finally:
                os.close(lock)
