"""What axe-core finds in a page that is open, in Chromium (playwright) or Firefox (`firefox.Tab`)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

AXE = "axe_playwright_python"
RUN = """axe.run(document, {iframes: false, resultTypes: ["violations"]}).then(({ violations }) => violations
  .filter(({ impact }) => %s.includes(impact))
  .flatMap(({ id, impact, nodes }) => nodes.map(
    ({ target, html }) => `${impact} ${id}: ${target.join(" ")} ${html.slice(0, 120)}`)))"""


def findings(tab: Any, impacts: tuple[str, ...] = ("serious", "critical")) -> list[str]:
    """Impact, rule, place and beginning of each element that breaks a rule of axe-core, of these impacts alone.

    tab: of either browser, or a frame: what evaluates an expression in it, and waits for what that promises.
    """
    package = pytest.importorskip(AXE, reason="axe-core is not installed: pip install axe-playwright-python")
    script = (Path(package.__file__).parent / "axe.min.js").read_text("utf-8")
    tab.evaluate(f"(() => {{ {script}\n }})()")
    return tab.evaluate(RUN % list(impacts))
