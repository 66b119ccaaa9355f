"""Both browsers behind one small face: what a person does on a page, and what axe-core finds wrong there."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

import pytest
from accessible import findings
from firefox import FIREFOX, firefox

BROWSERS = ("chromium", "firefox")
WIDTHS = (360, 1400)
PATIENCE = 240.0  # s, for one step on a busy machine


class Face(Protocol):
    """A tab of either browser; complaints: errors of its scripts."""

    complaints: list[str]

    def open(self, address: str) -> None:
        """A page."""

    def resize(self, width: int) -> None:
        """The window."""

    def evaluate(self, expression: str) -> Any:
        """The value of an expression, or of what it promises."""

    def click(self, selector: str) -> None:
        """The middle of an element, with the mouse."""

    def give(self, selector: str, *files: Path) -> None:
        """Files to an input."""


class Chromium:
    """A tab that playwright leads."""

    def __init__(self, browser: Any) -> None:
        self.tab = browser.new_context().new_page()
        self.complaints: list[str] = []
        self.tab.on("pageerror", lambda error: self.complaints.append(str(error)))

    def open(self, address: str) -> None:
        self.tab.goto(address)

    def resize(self, width: int) -> None:
        self.tab.set_viewport_size({"width": width, "height": 900})

    def evaluate(self, expression: str) -> Any:
        return self.tab.evaluate(expression)

    def click(self, selector: str) -> None:
        self.tab.click(selector)

    def give(self, selector: str, *files: Path) -> None:
        self.tab.set_input_files(selector, files)


@contextmanager
def face(name: str, request: pytest.FixtureRequest) -> Iterator[Face]:
    """A tab of a browser; the test is skipped where it, or what leads it, is absent."""
    if name == "chromium":
        tab = Chromium(request.getfixturevalue("browser"))
        yield tab
        tab.tab.context.close()
        return
    websockets = pytest.importorskip("websockets.sync.client", reason="websockets, which leads Firefox, is missing")
    if FIREFOX is None:
        pytest.skip("no Firefox is installed, in which the page could be opened")
    with firefox(websockets.connect) as tab:
        yield tab


def until(tab: Face, condition: str) -> None:
    """Wait until an expression is true, on whichever page the tab comes to."""
    end = time.monotonic() + PATIENCE
    while True:
        try:
            if tab.evaluate(f"document.readyState === 'complete' && Boolean({condition})"):
                return
        except Exception as error:  # between two pages there is none
            said = str(error)
        else:
            said = ""
        assert time.monotonic() < end, f"{condition} did not come true. {said}"
        time.sleep(0.2)


def serious(tab: Face) -> list[str]:
    """What axe-core calls serious or critical on the page, at both widths, and what is wider than the window."""
    found = []
    for width in WIDTHS:
        tab.resize(width)
        found += [f"{width}: {line}" for line in findings(tab)]
        wide = tab.evaluate("document.documentElement.scrollWidth")
        found += [f"{width}: the page is {wide} wide"] if wide > width else []
    return found
