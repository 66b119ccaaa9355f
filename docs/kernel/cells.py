"""What is there before the first cell of every page: commands whose failure is an error, and sharp pictures."""

from __future__ import annotations

from typing import Any


def _checked(shell: Any) -> None:
    run = shell.system

    def system(line: str) -> None:
        run(line)
        if shell.user_ns["_exit_code"]:
            raise RuntimeError(f"exit code {shell.user_ns['_exit_code']}: {line}")

    shell.system = system


_checked(get_ipython())  # type: ignore[name-defined]  # noqa: F821  (IPython's own name)
get_ipython().run_line_magic("config", "InlineBackend.figure_formats = ['svg']")  # type: ignore[name-defined]  # noqa: F821
