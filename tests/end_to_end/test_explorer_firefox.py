"""The page of `stickslip explore` in Firefox: another engine for its scripts, its canvas and its WebAssembly."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from firefox import FIREFOX, Tab, firefox

from fmu_models.explorer.page import explore
from fmu_models.fmu.load import load
from fmu_models.simulation.run import simulate

websockets = pytest.importorskip("websockets.sync.client", reason="websockets, by which Firefox is led, is missing")
pytestmark = pytest.mark.skipif(FIREFOX is None, reason="no Firefox is installed, in which the page could be opened")
MODEL = "forced_stick_slip"
ROWS = "page.motion.rows.slice(page.motion.from).map((row) => [...row.slice(0, 3)])"


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> str:
    return explore(MODEL).write(tmp_path_factory.mktemp("page") / "belt.html").as_uri()


@pytest.fixture(scope="module")
def tab() -> Iterator[Tab]:
    with firefox(websockets.connect) as made:
        yield made
        assert made.complaints == []
        assert {one.partition(":")[0] for one in made.requests} <= {"file", "data", "blob"}


def ready(tab: Tab, address: str, width: int = 1400) -> None:
    tab.resize(width)
    tab.open(address)
    tab.wait("globalThis.page?.motion?.complete")


@pytest.mark.parametrize("width", [360, 1400])
def test_its_picture_goes_through_the_points_that_the_suite_computes(tab: Tab, address: str, width: int):
    ready(tab, address, width)
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
    time, x, v = np.array(tab.evaluate(ROWS)).T
    known = simulate(load(MODEL), float(time[-1]), output_times=time)
    assert max(np.abs(x - known["x"]).max(), np.abs(v - known["v"]).max()) < 1e-9
    picture = tab.seen("#portrait")
    drawn = np.abs(picture - picture[1, 1]).max(axis=2) > 0.1
    plane, xs, ys = tab.evaluate("(({ plane, x, y }) => [plane, x, y])(page.pictures.portrait)")

    def there(x: float, v: float) -> bool:
        """Whether something is drawn within two pixels."""
        column = round(plane["left"] + (x - xs[0]) / (xs[1] - xs[0]) * (plane["right"] - plane["left"]))
        row = round(plane["bottom"] - (v - ys[0]) / (ys[1] - ys[0]) * (plane["bottom"] - plane["top"]))
        return bool(drawn[row - 2 : row + 3, column - 2 : column + 3].any())

    assert all(there(*point) for point in zip(known["x"][::20], known["v"][::20], strict=True))
    assert not there(1.1, 0.2)  # inside of the cycle


def test_a_slider_follows_the_keyboard_and_the_address_keeps_it(tab: Tab, address: str):
    ready(tab, address)
    tab.evaluate("document.querySelector('[aria-label^=\"omega: \"]').focus()")
    before = tab.evaluate("Number(document.activeElement.value)")
    tab.press("ArrowRight")
    tab.wait("page.motion.complete")
    assert tab.evaluate("Number(document.activeElement.value)") == before + 1
    tab.evaluate("document.querySelector('[aria-label=\"value of a0\"]').select()")
    tab.press("1.7", "Enter")
    tab.wait("page.motion.complete && location.hash.includes('1.7')")
    now = "[document.getElementById('state').value, page.motion.rows.map((row) => [...row])]"
    state, rows = tab.evaluate(now)
    linked = tab.evaluate("location.href")
    assert '"a0":1.7' in state and '"omega":' in state
    ready(tab, linked)
    assert tab.evaluate(now) == [state, rows]


def test_its_workers_compute_a_diagram(tab: Tab, address: str):
    ready(tab, address)
    tab.evaluate("document.getElementById('count').value = 4")
    tab.click("#sweep")
    tab.wait("document.getElementById('progress').textContent.startsWith('4 of 4 values in')")
