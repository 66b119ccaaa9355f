"""The studio in both browsers: from an empty folder to a fit, from a diagram to a basin and a branch, and what axe-core
says of every kind of page."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from pages import BROWSERS, Face, face, serious, until
from recorders import TRUTH, VALUES, bench, semicolons
from visitor import ROOT, Visitor

pytest.importorskip("tornado", reason="tornado is missing: pip install 'stickslip[studio]'")
pytestmark = pytest.mark.nightly
ENDED = "document.getElementById('status') && document.getElementById('status').textContent !== 'running'"


class Person:
    """Who works on the pages, in one browser: finds nothing wrong with any of them, and counts clicks."""

    def __init__(self, tab: Face, visitor: Visitor) -> None:
        self.tab, self.visitor = tab, visitor
        self.clicks = 0
        tab.open(visitor.address)

    def looks(self) -> None:
        assert serious(self.tab) == [], self.tab.evaluate("location.href")

    def goes(self, place: str) -> None:
        self.tab.open(self.visitor.base + place)

    def writes(self, name: str, text: str) -> None:
        field = f"document.querySelector({json.dumps(f'main [name={json.dumps(name)}]')})"
        told = f"{field}.dispatchEvent(new Event('input', {{ bubbles: true }}))"
        self.tab.evaluate(f"({field}.value = {json.dumps(text)}, {told})")

    def presses(self, words: str) -> None:
        """A button or a link of the page by what it says."""
        self.clicks += 1
        self.tab.evaluate(
            f"([...document.querySelectorAll('main button, main a')].find((one) => one.textContent === "
            f"{json.dumps(words)}).id = 'pressed', true)"
        )
        self.tab.click("#pressed")

    def runs(self) -> str:
        """The command of the form that is open, to its end; what it says."""
        self.presses("Run it")
        until(self.tab, ENDED)
        assert self.tab.evaluate("document.getElementById('status').textContent") == "done"
        return self.tab.evaluate("document.querySelector('main').innerText")


@pytest.fixture(params=BROWSERS)
def person(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Person]:
    with face(request.param, request) as tab:
        with closing(Visitor(tmp_path / "study")) as visitor:
            yield Person(tab, visitor)
        assert tab.complaints == []


def test_a_first_fit_from_an_empty_folder(person: Person, tmp_path: Path) -> None:
    folder = tmp_path / "recorder"
    folder.mkdir()
    semicolons(folder, bench())
    person.looks()
    person.tab.give("#dropped", *sorted(folder.glob("*.csv")))
    person.presses("Describe and fit them")
    until(person.tab, "document.querySelector('main h1').textContent === 'What the logs are'")
    person.looks()
    for key, text in tomllib.loads(VALUES)["values"].items():
        person.writes(f"value {key}", text)
    person.presses("Keep these answers and go on")
    until(person.tab, ENDED)
    person.looks()
    person.presses("fit")
    until(person.tab, "document.getElementById('line').textContent.includes('stickslip fit logs')")
    person.looks()
    person.presses("Run it")
    until(person.tab, "document.getElementById('progress')")
    person.looks()
    until(person.tab, ENDED)
    person.looks()
    assert "Residuals: white" in person.tab.evaluate("document.querySelector('main').innerText")
    fit = json.loads((person.visitor.folder / "fit.json").read_text())
    fitted = {row["name"]: row["value"] for row in fit["parameters"]}
    for name, value in TRUTH.items():
        assert fitted[name] == pytest.approx(value, rel=0.02)
    person.presses("report")
    until(person.tab, "document.getElementById('line').textContent.includes('stickslip report fit.json logs')")
    assert "The Conti law was fitted" in person.runs()
    person.looks()
    assert person.clicks == 6


def test_from_a_diagram_to_a_branch_and_a_basin(person: Person) -> None:
    person.goes("/give/diagram?first=discontinuous_support")
    for name, text in {"over": "omega=0.8:1.4:31", "forcing": "omega", "settings": "ks=300"}.items():
        person.writes(name, text)
    until(person.tab, "document.getElementById('line').textContent.includes('--set ks=300')")
    person.looks()
    assert "31 values" in person.runs()
    person.looks()
    rows = np.genfromtxt(person.visitor.folder / "diagram.csv", delimiter=",", usecols=(2, 4, 5), skip_header=1)
    ends = json.loads(person.tab.evaluate("document.getElementById('place').dataset.limits"))
    left, low, right, high = json.loads(person.tab.evaluate("document.getElementById('place').dataset.box"))
    person.tab.click("#place")
    clicked = [float(person.tab.evaluate(f"document.getElementById('at{i}').value")) for i in (1, 2)]
    shares = (0.5 - left) / (right - left), (low - 0.5) / (low - high)
    expected = [a + share * (b - a) for share, (a, b) in zip(shares, ends, strict=True)]
    assert clicked == pytest.approx(expected, abs=0.01 * (ends[1][1] - ends[1][0]))  # the mouse is at a whole pixel
    person.presses("branch")
    until(person.tab, "document.getElementById('line').textContent.includes('stickslip branch')")
    words = person.tab.evaluate("document.getElementById('line').textContent").split()
    assert f"omega={clicked[0]}" in words
    given = dict(word.split("=") for word in words if "=" in word)
    nearest = rows[np.abs(rows[:, 0] - clicked[0]).argmin()]
    assert [float(given[name]) for name in ("x", "v")] == nearest[1:].tolist()
    assert "range: omega" in person.runs()
    person.looks()
    # the same without a mouse: a number is written
    person.writes("at omega", "1.2")
    person.presses("basins")
    until(person.tab, "document.getElementById('line').textContent.includes('--set omega=1.2')")
    person.writes("over", "x=-6:6:9\nv=-6:6:9")
    assert "boundary" in person.runs()
    person.looks()
    person.writes("at x", "1.4")
    person.writes("at v", "-3.1")
    person.presses("simulate")
    until(person.tab, "document.getElementById('line').textContent.includes('--start x=1.5 --start v=-3.0')")
    person.writes("until", "5")
    person.runs()


def test_a_scene_is_dropped_and_exported(person: Person) -> None:
    person.tab.give("#model-file", ROOT / "data" / "scenes" / "block_on_belt_stick_slip.toml")
    person.presses("Look into it")
    until(person.tab, "document.getElementById('line').textContent.includes('scene block_on_belt_stick_slip.toml')")
    person.writes("figure", "portrait.png")
    assert "against what is known" in person.runs()
    person.looks()
    person.presses("export")
    until(person.tab, "document.getElementById('line').textContent.includes('export block_on_belt_stick_slip.toml')")
    person.looks()
    assert "Model Exchange" in person.runs()
    person.looks()
    assert [path.name for path in person.visitor.folder.glob("*.fmu")] == ["block_on_belt_stick_slip.fmu"]


def test_an_explorer_and_what_goes_wrong(person: Person) -> None:
    person.goes("/give/explore?first=block_on_belt")
    person.looks()
    person.runs()
    person.looks()
    person.goes("/give/simulate?first=blok_on_belt")
    person.presses("Run it")
    until(person.tab, ENDED)
    assert "Did you mean 'block_on_belt'" in person.tab.evaluate("document.querySelector('[role=alert]').textContent")
    person.looks()
    person.goes("/step/77")
    assert "There is no step 77" in person.tab.evaluate("document.querySelector('[role=alert]').textContent")
    person.looks()
    person.goes("/give/simulate?first=block_on_belt")
    person.writes("until", "1e7")
    person.presses("Run it")
    until(person.tab, "document.querySelector('#seconds') && document.querySelector('#seconds').textContent > 2")
    person.presses("Stop; what is finished stays")
    until(person.tab, ENDED)
    assert "stopped before its end" in person.tab.evaluate("document.querySelector('[role=alert]').textContent")
    person.looks()
