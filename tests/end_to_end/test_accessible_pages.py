"""What axe-core has against the pages that commands write, in both browsers: nothing serious, nothing critical."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from accessible import findings

from fmu_models.explorer.page import explore


@pytest.fixture(scope="module")
def belt(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return explore("forced_stick_slip").write(tmp_path_factory.mktemp("page") / "belt.html")


def test_chromium_finds_nothing_serious(browser: Any, belt: Path):
    tab = browser.new_context(viewport={"width": 1400, "height": 900}).new_page()
    tab.goto(belt.as_uri())
    tab.wait_for_selector("#readout dd")
    assert findings(tab) == []
    tab.evaluate("document.querySelector('#note').insertAdjacentHTML('afterend', '<img src=\"data:,\">')")
    assert [line.split(":")[0] for line in findings(tab)] == ["critical image-alt"]


def test_firefox_finds_nothing_serious(firefox_tab: Any, belt: Path):
    firefox_tab.open(belt.as_uri())
    firefox_tab.wait("document.querySelector('#readout dd')")
    assert findings(firefox_tab) == []
