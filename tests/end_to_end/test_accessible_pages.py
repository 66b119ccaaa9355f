"""The pages that commands write, as axe-core, a telephone and a printer see them: nothing serious, nothing cut off."""

from __future__ import annotations

import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from accessible import findings

DATA = Path(__file__).parents[2] / "data"
LOGS, ARM = DATA / "rigs" / "paper_rubber", DATA / "machines"
TWO = """
from dataclasses import replace
from fmu_models import Friction
from fmu_models.oscillators.block_on_belt import MODEL as one, x
rail = Friction(name="rail", slip=x.v + 0.05, law=one.contacts[0].law, description="block below a rail")
MODEL = replace(one, name="two", contacts=[*one.contacts, rail])
"""
OVER = ("--over", "x=-8:8:41", "--over", "v=-8:8:41")
SUPPORT = ("discontinuous_support", "--forcing", "omega")
SLOW = ("--rest", "0", "--interval", "600")  # s, from one loading of the page to the next
BENT = ("--disturbance", "within=12%", "--disturbance", "angle=10%")
# name of a page, and the commands that make it
PAGES: dict[str, list[tuple[str | Path, ...]]] = {
    "report": [("fit", LOGS, "-o", "fit.json"), ("report", "fit.json", LOGS, "-o", "report.html")],
    "bad": [
        ("emulate", "bad", "--seed", "3", "--speeds", "0.41,0.83", *BENT, "--beam", "arc"),
        ("fit", "bad", "-o", "bad.json", "--disturbances", "none", "--law-spread", "none"),
        ("report", "bad.json", "bad", "-o", "bad.html"),
    ],
    "bench": [
        (
            "bench",
            "block_on_belt",
            "--method",
            "event-driven",
            "--method",
            "RK45",
            "--until",
            "1",
            "--page",
            "bench.html",
        )
    ],
    "arm": [
        ("inverse", ARM / "two_link_arm.py", ARM / "two_link_arm_1.csv", "-o", "arm.json"),
        ("report", "arm.json", ARM / "two_link_arm_1.csv", "-o", "arm.html", "--trust"),
    ],
    "diagram": [("diagram", *SUPPORT, "--over", "omega=0.8:1:40", "--interactive", "diagram.html")],
    "basins": [("basins", *SUPPORT, "--set", "omega=1.18", *OVER, "--interactive", "basins.html")],
    "scene": [("explore", "disc_rig_figure_9", "-o", "scene.html")],
    "belt": [("explore", "forced_stick_slip", "-o", "belt.html")],
    "two": [("explore", "two.py", "-o", "two.html")],
    "watch": [("watch", LOGS, "--once", "--state", "watch.json", "--page", "watch.html", *SLOW)],
}
TEXTS = "p, li, td, th, caption, figcaption, summary, dd, dt, label, button, pre"
SMALL = f"""[...document.querySelectorAll("{TEXTS}")].filter((one) => one.checkVisibility()
  && parseFloat(getComputedStyle(one).fontSize) < 12).map((one) => one.outerHTML.slice(0, 99))"""
FIGURES = """[...document.querySelectorAll("figure svg")].filter((one) => one.checkVisibility()).flatMap((svg) => {
  const scale = svg.getBoundingClientRect().width / svg.viewBox.baseVal.width;
  return [...svg.querySelectorAll("text[style]")].map((one) => scale * parseFloat(getComputedStyle(one).fontSize));
}).filter((size) => size < 11.95)"""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A page by its name, made once."""
    folder = tmp_path_factory.mktemp("pages")
    (folder / "two.py").write_text(TWO)

    def page(name: str) -> str:
        path = folder / f"{name}.html"
        for arguments in PAGES[name] if not path.exists() else ():
            code = "from identification.cli import main; main()"
            subprocess.run([sys.executable, "-c", code, *map(str, arguments)], cwd=folder, check=True, timeout=500)
        return path.as_uri()

    return page


@pytest.mark.parametrize("name", PAGES)
def test_chromium_finds_nothing_serious_at_any_width(browser: Any, made: Any, name: str):
    address = made(name)
    for width in (1400, 360):
        tab = browser.new_context(viewport={"width": width, "height": 900}).new_page()
        tab.goto(address)
        tab.wait_for_timeout(500)
        assert findings(tab) == []
        assert tab.evaluate("document.documentElement.scrollWidth") <= width
        assert tab.evaluate(SMALL) == [] and tab.evaluate(FIGURES) == []
        levels = tab.evaluate("[...document.querySelectorAll('h1, h2, h3, h4')].map((one) => Number(one.tagName[1]))")
        assert levels[0] == 1 and all(after - before <= 1 for before, after in pairwise(levels))
        tab.context.close()


@pytest.mark.parametrize("name", ["report", "bad", "arm", "belt", "watch"])
def test_firefox_finds_nothing_serious_at_any_width(firefox_tab: Any, made: Any, name: str):
    address = made(name)
    for width in (1400, 360):
        firefox_tab.resize(width)
        firefox_tab.open(address)
        assert firefox_tab.evaluate("document.documentElement.scrollWidth") <= width
    assert findings(firefox_tab) == []


def test_a_fault_is_found(browser: Any, made: Any):
    tab = browser.new_context().new_page()
    tab.goto(made("belt"))
    tab.evaluate("document.body.insertAdjacentHTML('beforeend', '<img src=\"data:,\">')")
    assert [line.split(":")[0] for line in findings(tab)] == ["critical image-alt"]


@pytest.mark.parametrize(("name", "height"), [("report", 1800), ("bad", 1800), ("arm", 1800)])
def test_verdict_values_and_pictures_stand_on_two_screens(browser: Any, made: Any, name: str, height: int):
    tab = browser.new_context(viewport={"width": 1400, "height": 900}).new_page()
    tab.goto(made(name))
    ends = tab.evaluate(
        "['.verdict', 'table', '.glance'].map((one) => document.querySelector(one).getBoundingClientRect().bottom)"
    )
    assert ends == sorted(ends) and ends[-1] < height


def test_what_is_folded_is_printed(browser: Any, made: Any, tmp_path: Path):
    tab = browser.new_context().new_page()
    tab.goto(made("report"))
    tab.emulate_media(media="print")
    tables = "[...document.querySelectorAll('details table')]"
    shown = f"{tables}.filter((one) => one.checkVisibility({{contentVisibilityAuto: true}})).length"
    assert tab.evaluate(shown) == tab.evaluate(f"{tables}.length") > 5
    pages = len(re.findall(rb"/Type\s*/Page\b", tab.pdf(format="A4")))
    assert 3 <= pages <= 12


def test_the_portrait_stays_above_the_sliders_of_a_telephone(browser: Any, made: Any):
    tab = browser.new_context(viewport={"width": 360, "height": 740}).new_page()
    tab.goto(made("belt"))
    tab.wait_for_selector("#readout dd")
    last = tab.locator("#parameters input[type=range]").last
    last.focus()
    portrait, slider = tab.locator("#portrait").bounding_box(), last.bounding_box()
    assert portrait["y"] >= 0 and portrait["y"] + portrait["height"] <= slider["y"] <= 740


@pytest.mark.parametrize(("name", "over"), [("belt", "omega"), ("scene", "w0"), ("two", "v_belt")])
def test_the_diagram_begins_filled_over_what_forces_the_motion(browser: Any, made: Any, name: str, over: str):
    tab = browser.new_context(viewport={"width": 1400, "height": 900}).new_page()
    tab.goto(made(name))
    tab.wait_for_selector("#progress:has-text('values in')")
    assert tab.evaluate("document.querySelector('#over').selectedOptions[0].text") == over
    assert tab.evaluate("page.swept.points.size") == 160 and tab.inner_text("#note") == ""
