"""Pages of help, kept in the user's cache as they were printed: to make one takes typer, rich and files of commands."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from fmu_models.base.cache import cache_folder, digest
from fmu_models.base.errors import StickslipError
from fmu_models.base.files import sealed_text, stamps

if TYPE_CHECKING:
    from typing import TextIO

# what rich and typer ask about the terminal
ENVIRONMENT = (
    *("COLORTERM", "COLUMNS", "FORCE_COLOR", "GITHUB_ACTIONS", "JPY_PARENT_PID", "JUPYTER_COLUMNS", "LINES"),
    *("NO_COLOR", "PY_COLORS", "TERM", "TERMINAL_WIDTH", "TTY_COMPATIBLE", "TTY_INTERACTIVE", "TYPER_USE_RICH"),
    *("UNICODE_VERSION", "_TYPER_FORCE_DISABLE_TERMINAL"),
)
ROOT, PACKAGES = Path(__file__).parents[2], ("fmu_models", "identification", "rig_io")


class _Recorder:
    """A stream that remembers what is written to it."""

    def __init__(self, stream: TextIO) -> None:
        self.stream, self.texts = stream, list[str]()

    def write(self, text: str) -> int:
        written = self.stream.write(text)  # first: click finds out what it takes by what it refuses
        self.texts.append(text)
        return written

    def __getattr__(self, name: str) -> object:
        return getattr(self.stream, name)


def with_pages(arguments: Sequence[str], run: Callable[[], None]) -> None:
    """Run a command line, or print the page of help that it asks for if one was printed on such a terminal before."""
    page = _page(arguments)
    if page is None:
        return run()
    printed = False

    def make() -> str:
        nonlocal printed
        recorder = _Recorder(sys.stdout)
        sys.stdout = recorder  # type: ignore[assignment] # does what its stream does
        try:
            run()
        except SystemExit as end:
            if end.code:
                raise
        finally:
            sys.stdout = recorder.stream
        printed = True
        return "".join(recorder.texts)

    text = sealed_text(page, make)
    if not printed:
        try:
            sys.stdout.write(text)
            sys.stdout.flush()
        except OSError:
            run()  # which says what is wrong with the output
    sys.exit(0)


def _page(arguments: Sequence[str]) -> Path | None:
    """Where the page of a command of ours, or of all, is kept; None if another thing is asked for."""
    # the terminal of Windows is not written to alone
    if len(arguments) not in (1, 2) or arguments[-1] not in ("--help", "-h") or os.name == "nt":
        return None
    files = sorted(line for package in PACKAGES for line in stamps(ROOT / package))
    name = f"{os.sep}{arguments[0]}.py\n"
    if len(arguments) == 2 and not any(f"commands{name}" in line or f"analyses{name}" in line for line in files):
        return None  # of an installed package, which may change
    # where packages are installed, the time changes with each
    installed = [str(os.stat(folder).st_mtime_ns) for folder in sys.path if os.path.isdir(folder)]
    terminal = [str(sys.stdout.isatty()), str(sys.stdout.encoding), *map(_width, range(3))]
    environment = [os.environ.get(name, "\0") for name in ENVIRONMENT]
    key = digest(sys.version, *arguments, *files, *installed, *terminal, *environment)
    with suppress(StickslipError):
        return cache_folder() / "help" / f"{key}.txt"


def _width(stream: int) -> str:
    try:
        return str(os.get_terminal_size(stream))
    except OSError:
        return ""
