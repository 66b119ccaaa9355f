"""The page of `stickslip explore` in Firefox: another engine for its scripts, its canvas and its WebAssembly."""

from __future__ import annotations

import numpy as np
import pytest
from firefox import Tab

from fmu_models.explorer.page import explore
from fmu_models.fmu.load import load
from fmu_models.simulation.run import simulate

MODEL = "forced_stick_slip"
ROWS = "page.motion.rows.slice(page.motion.from).map((row) => [...row.slice(0, 3)])"


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> str:
    return explore(MODEL).write(tmp_path_factory.mktemp("page") / "belt.html").as_uri()


def ready(firefox_tab: Tab, address: str, width: int = 1400) -> None:
    firefox_tab.resize(width)
    firefox_tab.open(address)
    firefox_tab.wait("globalThis.page?.motion?.complete")


@pytest.mark.parametrize("width", [360, 1400])
def test_its_picture_goes_through_the_points_that_the_suite_computes(firefox_tab: Tab, address: str, width: int):
    ready(firefox_tab, address, width)
    assert firefox_tab.evaluate("document.documentElement.scrollWidth") <= width
    time, x, v = np.array(firefox_tab.evaluate(ROWS)).T
    known = simulate(load(MODEL), float(time[-1]), output_times=time)
    assert max(np.abs(x - known["x"]).max(), np.abs(v - known["v"]).max()) < 1e-9
    picture = firefox_tab.seen("#portrait")
    drawn = np.abs(picture - picture[1, 1]).max(axis=2) > 0.1
    plane, xs, ys = firefox_tab.evaluate("(({ plane, x, y }) => [plane, x, y])(page.pictures.portrait)")

    def there(x: float, v: float) -> bool:
        """Whether something is drawn within two pixels."""
        column = round(plane["left"] + (x - xs[0]) / (xs[1] - xs[0]) * (plane["right"] - plane["left"]))
        row = round(plane["bottom"] - (v - ys[0]) / (ys[1] - ys[0]) * (plane["bottom"] - plane["top"]))
        return bool(drawn[row - 2 : row + 3, column - 2 : column + 3].any())

    assert all(there(*point) for point in zip(known["x"][::20], known["v"][::20], strict=True))
    assert not there(1.1, 0.2)  # inside of the cycle


def test_a_slider_follows_the_keyboard_and_the_address_keeps_it(firefox_tab: Tab, address: str):
    ready(firefox_tab, address)
    firefox_tab.evaluate("document.querySelector('[aria-label^=\"omega: \"]').focus()")
    before = firefox_tab.evaluate("Number(document.activeElement.value)")
    firefox_tab.press("ArrowRight")
    firefox_tab.wait("page.motion.complete")
    assert firefox_tab.evaluate("Number(document.activeElement.value)") == before + 1
    firefox_tab.evaluate("document.querySelector('[aria-label=\"value of a0\"]').select()")
    firefox_tab.press("1.7", "Enter")
    firefox_tab.wait("page.motion.complete && location.hash.includes('1.7')")
    now = "[document.getElementById('state').value, page.motion.rows.map((row) => [...row])]"
    state, rows = firefox_tab.evaluate(now)
    linked = firefox_tab.evaluate("location.href")
    assert '"a0":1.7' in state and '"omega":' in state
    ready(firefox_tab, linked)
    assert firefox_tab.evaluate(now) == [state, rows]


def test_its_workers_compute_a_diagram(firefox_tab: Tab, address: str):
    ready(firefox_tab, address)
    firefox_tab.evaluate("document.getElementById('count').value = 4")
    firefox_tab.click("#sweep")
    firefox_tab.wait("document.getElementById('progress').textContent.startsWith('4 of 4 values in')")
