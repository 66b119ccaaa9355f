"""The manual as a site: the built one that a wheel brings, else one in the cache, of this very state of the sources.

    digest of the manual, the packages and data -> <cache>/manual-<digest>/index.html, or manual-<digest>-plain

A full one is built when it is asked for, in minutes; without it the pages are shown as they are written
(plain_manual.py). Sphinx runs in a process of its own upon a copy of the sources, since pages that are made from the
code are written among them. A site appears under its name when it is whole.
"""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from fmu_models.base import shipped
from fmu_models.base.cache import cache_folder, digest
from fmu_models.base.child_process import kill_session
from fmu_models.base.errors import StickslipError
from fmu_models.base.temporary import temporary_folder
from fmu_models.report import plain_manual

NEEDED = ("furo", "myst_nb", "sphinx")
# what Sphinx says it does, and the share of a build after which it begins: pictures are computed, then cells run
PHASES = {"making": (0.0, 0.5), "reading": (0.5, 0.85), "writing": (0.85, 1.0)}
LAST_WORDS = 12  # lines of a build that failed
KEPT = 3  # sites in the cache: of other versions or checkouts
# what an earlier build may have made among the sources
MADE = shutil.ignore_patterns("__pycache__", "gallery", "python", shipped.SITE)


@dataclass(frozen=True)
class Site:
    """A manual. folder: where it is; built: now, or found; plain: pages as they are written."""

    folder: Path
    built: bool
    plain: bool = False

    @property
    def index(self) -> Path:
        """The manual's first page."""
        return self.folder / "index.html"

    @property
    def pages(self) -> int:
        """How many pages it has."""
        return sum(1 for _ in self.folder.rglob("*.html"))


def manual_site(
    *, build: bool = False, strict: bool = False, progress: Callable[[float], None] = lambda _: None
) -> Site:
    """The manual of this very suite.

    Args:
        build: in full, if it has not been; otherwise pages are as they are written where no full ones are found.
        strict: warnings of Sphinx are errors, and a site that is there is not taken.
        progress: told the share that is done.

    Raises:
        StickslipError: the extra is not installed, or the build fails; says what its last words were.
    """
    target = cache_folder() / f"manual-{_state()}"
    for folder in (shipped.site(), target):
        if folder.is_dir() and not strict:
            return Site(folder, built=False)
    if not (build or strict):
        return _plain(target.with_name(f"{target.name}-plain"))
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        raise StickslipError(
            f"The manual is built by Sphinx. Not installed: {', '.join(missing)}. Install what it needs: "
            "pip install 'stickslip[docs]'"
        )
    with temporary_folder("manual", target.parent) as work:
        shutil.copytree(shipped.manual(), work / "source", ignore=MADE)
        _build(work, strict, progress)
        _keep(work / "site", target)
    return Site(target, built=True)


def _plain(target: Path) -> Site:
    if target.is_dir():
        return Site(target, built=False, plain=True)
    with temporary_folder("manual", target.parent) as work:
        plain_manual.write(work / "site")
        _keep(work / "site", target)
    return Site(target, built=True, plain=True)


def _keep(site: Path, target: Path) -> None:
    if target.is_dir():
        shutil.rmtree(target)
    os.replace(site, target)
    forget_old(target.parent)


def forget_old(folder: Path) -> None:
    """Remove all sites there but those built last."""
    sites = sorted(folder.glob("manual-*"), key=lambda site: site.stat().st_mtime)
    for site in sites[:-KEPT]:
        shutil.rmtree(site, ignore_errors=True)


def _state() -> str:
    """Digest of all that a page may show."""
    return digest(*(item for path in sorted(_sources()) for item in (path.name, path.read_bytes())))


def _sources() -> Iterator[Path]:
    folders = (
        shipped.manual(),
        shipped.folder(),
        *(shipped.ROOM / name for name in ("fmu_models", "identification", "rig_io")),
    )
    for folder in folders:
        for path in folder.rglob("*"):
            inside = path.relative_to(folder).parts
            if path.is_file() and not MADE("", list(inside)):
                yield path


def _build(work: Path, strict: bool, progress: Callable[[float], None]) -> None:
    line = [sys.executable, "-P", "-m", "sphinx", "-b", "html", "-j", "auto", "-d", str(work / "trees")]
    line += [*(["-W", "--keep-going"] if strict else []), str(work / "source"), str(work / "site")]
    paths = [str(shipped.ROOM), os.environ.get("PYTHONPATH", "")]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))}
    with (
        open(work / "said", "w+", encoding="utf-8", errors="replace") as log,
        subprocess.Popen(
            line,
            stdout=subprocess.PIPE,
            stderr=log,
            env=environment,
            text=True,
            encoding="utf-8",
            errors="replace",
            start_new_session=True,
        ) as process,
    ):
        assert process.stdout is not None
        try:
            for words in process.stdout:
                if match := re.match(r"(making|reading|writing) .*\[ *(\d+)%\]", words):
                    start, end = PHASES[match[1]]
                    progress(start + (end - start) * int(match[2]) / 100)
        except BaseException:  # an interrupt reaches this process alone, and Sphinx has others that read pages
            kill_session(process)
            raise
        process.wait()
        log.seek(0)
        lines = [text.rstrip() for text in log if text.strip()]
    if process.returncode:
        complaints = [text for text in lines if re.search(": (WARNING|ERROR): ", text)] or lines
        raise StickslipError("The manual cannot be built. Sphinx says: " + "\n".join(complaints[-LAST_WORDS:]))
