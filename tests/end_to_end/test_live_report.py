"""The live frame of a report in a browser: the same portraits and verdicts as the suite computes, for any values."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from firefox import Tab
from made_fit import made_fit

from fmu_models.base.version import version
from identification.fit.fit import fit_friction
from identification.fit.result import FrictionFit
from identification.fitted_model.model import TRANSIENT, FittedModel, fitted_model
from identification.model_check.families import FamilyComparison, processing_of
from identification.model_check.portraits import Portrait, PortraitComparison, Rest, Settling, compare_motions
from identification.report.live import MOST, live_frame
from identification.report.page import write_report
from identification.report.rig_page import RigFindings
from rig_io.bench.emulator import emulate, standard_set

FIT = made_fit(discs=2)
LENGTH, STEP = 14.0, 2e-3
FAST = 2.1  # rad/s, where steady sliding of disc0 is stable and a cycle with stick exists as well


def motion(model: FittedModel, speeds: Mapping[str, float], changed: Mapping[str, float]) -> Portrait | Rest:
    """As in a comparison: filtered alike, whatever the values."""
    moved = model.with_parameters({**model.parameters, **changed})
    # the same time as before, so that the same moments are sampled
    run = moved.run(speeds, LENGTH, STEP, transient=TRANSIENT * model.natural_period / moved.natural_period)
    drives = {contact: np.full(len(run.time), speed) for contact, speed in speeds.items()}
    return processing_of(model).motion(run.time, run.angle, drives, "the model", run.states)


def family(discs: tuple[str, ...]) -> FamilyComparison:
    """Logs of a rig whose law is a little other than the fit says."""
    model = fitted_model(FIT, contacts=discs)
    members = []
    for speed in (0.5, 1.2, FAST):
        speeds = {"disc0": speed, "disc1": 0.83} if len(discs) == 2 else {"disc0": speed}
        measured = motion(model, speeds, {"mu_s0": 0.66, "mu_k0": 0.36})
        found = motion(model, speeds, {})
        if speed == FAST and len(discs) == 1:  # a bench that slides steadily is held against the model that does
            slides = model.sliding(speeds)
            assert slides and slides.damping > 0 and isinstance(found, Portrait)
            measured = Rest(slides.angle, 0.0)
            found = replace(measured, words="steady sliding (from another start stick-slip)")
        verdicts = compare_motions(measured, found)
        members.append(PortraitComparison(f"log{speed}", speeds, measured, found, verdicts, length=LENGTH, step=STEP))
    return FamilyComparison(tuple(members), "disc0", None, ())


@pytest.fixture(scope="module")
def families() -> tuple[FamilyComparison, ...]:
    return family(("disc0",)), family(("disc0", "disc1"))


@pytest.fixture(scope="module")
def report(families: tuple[FamilyComparison, ...], tmp_path_factory: pytest.TempPathFactory) -> Path:
    live = live_frame(FIT, families)
    assert live.notes == () and live._repr_html_() == live.html  # as a notebook shows it
    findings = RigFindings(FIT, (), (), live=live.html)
    return write_report(findings, tmp_path_factory.mktemp("report") / "report.html")


@pytest.fixture(scope="module")
def frame(browser: Any, report: Path) -> Iterator[Any]:
    tab = browser.new_page()
    complaints: list[str] = []
    requests: list[str] = []
    tab.on("console", lambda message: complaints.append(message.text))
    tab.on("pageerror", lambda error: complaints.append(str(error)))
    tab.on("request", lambda request: requests.append(request.url))
    tab.goto(report.as_uri())
    tab.frame_locator("iframe").locator("#metrics tr").first.wait_for()
    yield tab.frames[1]
    assert complaints == [] and requests == [report.as_uri()]


def results(frame: Any) -> list[dict[str, Any]]:
    """Of the frame in either browser, when they are complete."""
    return frame.evaluate(
        """new Promise((done) => {
          const told = ({ motion, metrics }) => ({
            metrics: Object.fromEntries(metrics.map((one) => [one.name, [one.value, one.passed]])), words: motion.words,
            angle: motion.angle && [...motion.angle], speed: motion.speed && [...motion.speed] });
          const look = () => live.complete ? done(live.results.map(told)) : setTimeout(look, 20);
          look();
        })"""
    )


def agree(found: dict[str, Any], known: PortraitComparison) -> None:
    expected = {one.name: one for one in known.verdicts if one.passed is not None}
    assert set(found["metrics"]) == set(expected) and found["words"] == known.model.words
    for name, (value, passed) in found["metrics"].items():
        assert value == pytest.approx(expected[name].value, abs=2e-5), name  # of measured curves kept to 1e-5
        assert passed == expected[name].passed
    if isinstance(known.model, Portrait):
        assert np.abs(np.array(found["angle"]) - known.model.angle).max() < 1e-7
        assert np.abs(np.array(found["speed"]) - known.model.speed).max() < 1e-6


@pytest.mark.parametrize("number", [0, 1])
def test_it_begins_with_the_portraits_and_verdicts_of_the_comparison(frame: Any, families: Any, number: int):
    if number:
        frame.select_option("#family", str(number))
    for found, known in zip(results(frame), families[number].members, strict=True):
        agree(found, known)


def test_sliders_move_the_model_within_the_intervals(frame: Any, families: Any):
    frame.select_option("#family", "0")
    slider = frame.get_by_label(re.compile("^mu_s0: "))
    low, high = FIT.interval("mu_s0")
    slider.press("End")
    slider_value = float(frame.get_by_label("value of mu_s0", exact=True).input_value())
    assert slider_value == pytest.approx(high, rel=1e-6) and low < 0.65 < high
    for name, value in (("N0", "5.2"), ("k", "2.7")):
        entry = frame.get_by_label(f"value of {name}", exact=True)
        entry.fill(value)
        entry.press("Enter")
    model = fitted_model(FIT, contacts=("disc0",))
    changed = {"mu_s0": slider_value, "N0": 5.2, "k": 2.7}
    for found, one in zip(results(frame)[:2], families[0].members[:2], strict=True):
        moved = motion(model, one.drive_speeds, changed)
        agree(found, replace(one, model=moved, verdicts=compare_motions(one.measured, moved)))
    frame.locator("#log").press("ArrowRight")
    assert "log1.2" in frame.inner_text("#which")
    assert f"stickslip {version()}" in frame.inner_text("figure")
    assert frame.inner_text("#verdict") == "FAIL: period" and frame.inner_text("#note") == ""
    frame.click("#fitted")
    agree(results(frame)[1], families[0].members[1])


def test_it_tells_what_is_no_value_and_what_the_model_refuses(frame: Any):
    entry = frame.get_by_label("value of k", exact=True)
    for value, where, said in (
        ("stiff", "#note", "'stiff' is not a number; k stays as it is"),
        ("9", "#note", "Outside of its interval: k"),
        ("-1", "#refusal", "k must be >= 0 N m/rad"),
    ):
        entry.fill(value)
        entry.press("Enter")
        assert said in frame.inner_text(where)
    frame.click("#fitted")
    assert not frame.is_visible("#refusal")


def test_what_cannot_move_is_named():
    late = replace(family(("disc0",)).members[0], settling=Settling(3.0, None))
    live = live_frame(FIT, [FamilyComparison((late,), "disc0", None, ())])
    assert live.html == "" and "begins before it has settled: log0.5" in live._repr_html_()


@pytest.fixture(scope="module")
def shown() -> FrictionFit:
    logs = [emulate(one, 1, number) for number, one in enumerate(standard_set(duration=8.0)[1:])]
    return fit_friction(logs, estimator="weak-form")


@pytest.fixture(scope="module")
def notebook(shown: FrictionFit, tmp_path_factory: pytest.TempPathFactory) -> str:
    """Address of the page of a notebook that shows a fit."""
    notebooks = pytest.importorskip("nbformat.v4", reason="nbformat, which makes notebooks, is missing")
    nbconvert = pytest.importorskip("nbconvert", reason="nbconvert, which makes a page of a notebook, is missing")
    html = shown._repr_html_()
    assert "<table" in html and html.count("<iframe sandbox=") == 1
    both = {"text/html": html, "text/plain": repr(shown)}
    output = notebooks.new_output("execute_result", both, execution_count=1)
    cell = notebooks.new_code_cell("fit", outputs=[output], execution_count=1)
    written, _ = nbconvert.HTMLExporter(template_name="basic").from_notebook_node(notebooks.new_notebook(cells=[cell]))
    page = tmp_path_factory.mktemp("notebook") / "fit.html"
    page.write_text(written, "utf-8")
    return page.as_uri()


def test_a_notebook_shows_a_fit_live_and_its_page_needs_no_network(frame: Any, shown: FrictionFit, notebook: str):
    tab = frame.page.context.browser.new_page()
    said: list[str] = []
    tab.on("request", lambda request: said.append(request.url))
    tab.on("console", lambda message: said.append(message.text))
    tab.goto(notebook)
    tab.frame_locator("iframe").locator("#metrics tr").first.wait_for()
    assert tab.frame_locator("iframe").locator("#which").inner_text().startswith(f"{shown.recorded[0].name}: disc0 ")
    assert said == [notebook]
    # of a file there is the table alone, and where no comparison can be made the reason beside it
    read = FrictionFit.from_json(shown.to_json())
    assert "<table" in read._repr_html_() and "<iframe" not in read._repr_html_()
    still = replace(read, recorded=(shown.recorded[-1],))._repr_html_()
    assert "<table" in still and "<p>Not live: There is no stick-slip log among those given." in still


def test_firefox_shows_the_same_in_a_notebook_and_in_a_report(firefox_tab: Tab, notebook: str, report: Path, families):
    tab = firefox_tab
    for address, width in ((notebook, 360), (report.as_uri(), 1400)):
        tab.resize(width)
        tab.open(address)
        tab.enter()
        tab.wait("document.querySelector('#metrics tr')")
        assert tab.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert len(results(tab)) == 3
    for found, known in zip(results(tab), families[0].members, strict=True):
        agree(found, known)
    tab.click("#s-mu_s0")
    tab.press("End")
    assert tab.evaluate("live.values.mu_s0") == pytest.approx(FIT.interval("mu_s0")[1], rel=1e-6)
    tab.evaluate("document.querySelector('[aria-label=\"value of k\"]').select()")
    tab.press("2.7", "Enter")
    one = families[0].members[0]
    moved = motion(fitted_model(FIT, contacts=("disc0",)), one.drive_speeds, tab.evaluate("live.values"))
    agree(results(tab)[0], replace(one, model=moved, verdicts=compare_motions(one.measured, moved)))


def test_the_page_grows_by_little_and_only_then_has_scripts(report: Path, tmp_path: Path):
    plain = write_report(RigFindings(FIT, (), ()), tmp_path / "plain.html").read_text("utf-8")
    grown = report.stat().st_size - len(plain.encode())
    assert 40_000 < grown <= MOST and "<iframe" not in plain and plain.count("<script") == 1
