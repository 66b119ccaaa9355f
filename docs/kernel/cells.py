"""What is there before the first cell of every page: commands whose failure is an error, and sharp pictures."""

from __future__ import annotations

import re
import subprocess
from typing import Any

PROGRESS = re.compile(r"^stickslip: .*: \d+%.*\n", re.MULTILINE)  # of slow machines alone


def _command(line: str) -> None:
    """Run a command as in a pipe, where nobody answers, and print what it says."""
    found = subprocess.run(
        line,
        shell=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    print(PROGRESS.sub("", found.stdout), end="")
    if found.returncode:
        raise RuntimeError(f"exit code {found.returncode}: {line}")


def _prepare(shell: Any) -> None:
    # names of Python in braces, as IPython's own does it
    shell.system = lambda line: _command(shell.var_expand(line, depth=1))
    shell.run_line_magic("config", "InlineBackend.figure_formats = ['svg']")


_prepare(get_ipython())  # type: ignore[name-defined]  # noqa: F821  (IPython's own name)
