"""What the manual says can be run: commands and Python of the README and the pages (cells run as these are built)."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

from checkout import ROOT

MADE = ("reference", "python", "gallery", "scenes", "oscillators", "calibrations")


def pages() -> list[Path]:
    """The README first, then the pages by name; not those that are made when the manual is built."""
    written = [page for page in (ROOT / "docs").rglob("*.md") if page.parent.name not in MADE]
    return [ROOT / "README.md", *sorted(written)]


def _fenced(text: str) -> Iterator[tuple[str, str]]:
    """Word behind the fence, and content, of each block."""
    yield from re.findall(r"^```(\{?[\w-]*\}?)[^\n]*\n(.*?)^```", text, re.S | re.M)


def commands(page: Path) -> list[list[str]]:
    """Those that stand indented or in a block of shell, without the word stickslip; lines that go on are joined."""
    text = page.read_text("utf-8").replace("\\\n", "")
    shell = [body for word, body in _fenced(text) if word in ("sh", "bash", "console", "shell")]
    lines = re.findall(r"^ {4}(stickslip .*)$", text, re.M)
    lines += re.findall(r"^(?:\$ )?(stickslip .*)$", "\n".join(shell), re.M)
    return [shlex.split(line, comments=True)[1:] for line in lines]


def python(page: Path) -> str:
    """All blocks of Python on a page, one after the other; those of the cells are not among them."""
    return "\n".join(body for word, body in _fenced(page.read_text("utf-8")) if word == "python")


def cells(page: Path) -> str:
    """All code cells of a page."""
    return "\n".join(body for word, body in _fenced(page.read_text("utf-8")) if word == "{code-cell}")
