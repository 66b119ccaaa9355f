"""Families as figures, tables and a page: readable without colour, self-contained, every value that was computed."""

from __future__ import annotations

import io
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from made_fit import made_fit

from fmu_models.base.errors import StickslipError
from fmu_models.report.inline_svg import inline_svg
from identification.fit.parts import LogSummary
from identification.inference.whiteness import LogResiduals, SpeedResidual, Whiteness
from identification.model_check.bifurcations import BifurcationComparison, MeasuredBifurcation, Transition
from identification.model_check.families import FamilyComparison
from identification.model_check.portraits import PHASES, Portrait, PortraitComparison, Rest, Stick, compare_motions
from identification.model_check.table import bifurcation_sentences, comparison_report
from identification.report.family_figure import family_figure
from identification.report.page import page, write_report
from identification.report.residual_figure import correlations, residual_figure
from identification.report.rig_page import RigFindings

TURN = 2 * np.pi * np.arange(PHASES) / PHASES
VOID = {"meta", "br", "img", "hr", "link", "input"}


def portrait(scale: float = 1.0, discs: int = 1) -> Portrait:
    strip = (np.arange(PHASES) < 0.2 * PHASES).astype(float)
    sticks = {
        f"disc{i}": Stick(0.2, np.roll(strip, 100 * i), np.array([0.04]), True, np.roll(strip, 100 * i))
        for i in range(discs)
    }
    return Portrait(0.1 * scale * np.cos(TURN), 0.5 * np.sin(TURN), 1.0, 0.1 * scale, sticks, 9)


def member(name: str, speed: float, model: Portrait | Rest | None = None, discs: int = 1) -> PortraitComparison:
    measured, model = portrait(discs=discs), model or portrait(discs=discs)
    speeds = {"disc0": speed, "disc1": 0.83} if discs == 2 else {"disc0": speed}
    return PortraitComparison(name, speeds, measured, model, compare_motions(measured, model))


def family(discs: int = 1) -> FamilyComparison:
    wrong = replace(portrait(1.2, discs))
    members = (member("slow", 0.41, discs=discs), member("a < b", 0.83, wrong, discs))
    rests = Rest(0.1, 1e-4), Rest(0.1, 0.0)
    sliding = PortraitComparison(
        "fast", {**members[0].drive_speeds, "disc0": 2.8}, rests[0], rests[1], compare_motions(*rests)
    )
    measured = MeasuredBifurcation("disc0", 0.83, 2.8, ("disc0",), (), 2.3, 0.05)
    predicted = Transition("disc0", 2.38, ("disc0",), (), 0.01, 0.02)
    other = BifurcationComparison(MeasuredBifurcation("disc0", 1.0, float("inf"), ("disc0",), ()), None, None, False)
    return FamilyComparison(
        (*members, sliding), "disc0", 1.67, (BifurcationComparison(measured, predicted, 2.33, True), other)
    )


def test_the_figure_tells_measured_from_model_without_colour() -> None:
    figure = family_figure(family(discs=2))
    portraits = [axes for axes in figure.axes if axes.get_xlabel() == "angle (rad)"]
    assert [axes.get_title().split(",")[0] for axes in portraits] == ["slow", "a < b", "fast"]
    assert "fail: amplitude" in portraits[1].get_title() and "pass" in portraits[0].get_title()
    measured, model = portraits[0].lines
    assert measured.get_linestyle() != model.get_linestyle()
    assert measured.get_linewidth() > 2 * model.get_linewidth()
    assert model.get_marker() == "o" and measured.get_marker() in ("", "None", None)
    assert measured.get_xdata()[0] == measured.get_xdata()[-1]  # type: ignore[index]
    rest, modelled = portraits[2].lines
    assert rest.get_marker() != modelled.get_marker()
    strips = [axes for axes in figure.axes if axes.get_xlabel().startswith("stick")]
    # measured, model alike and its contact states, for two discs; none where both slide
    assert [len(axes.collections) for axes in strips] == [6, 6, 0]
    diagram = figure.axes[-1]
    said = " ".join(text.get_text() for text in diagram.get_legend().get_texts())  # type: ignore[union-attr]
    for part in (
        "measured disc0",
        "model disc1",
        "between 0.83 and 2.8",
        "2.380 ± 0.044",
        "above 1.67",
        "2.300 ± 0.098",
    ):
        assert part in said
    # the model's Hopf bifurcation, then where stick disappears with the ends of its interval
    upright = [float(x[0]) for line in diagram.lines if len(set(x := np.asarray(line.get_xdata()))) == 1 and len(x) > 1]
    assert upright == pytest.approx([1.67, 2.38, 2.336, 2.424], abs=5e-4)


def test_tables_and_sentences_show_values_verdicts_and_what_a_pass_means() -> None:
    from rich.console import Console

    console = Console(width=160, record=True, file=io.StringIO())
    console.print(comparison_report([family()]))
    text = console.export_text()
    for shown in ("a < b", "FAIL", "pass", "no more", "+20 %", "same motion", "steady sliding", "stick on disc0"):
        assert shown in text
    told = bifurcation_sentences(family())
    assert told[0].startswith(
        "Stick on disc0 disappears: predicted at 2.380 ± 0.044 rad/s (95 %; noise 0.020, rig constants 0.039)"
    )
    assert (
        "measured between 0.83 and 2.8 rad/s, carried on to no stick 2.300 ± 0.098 rad/s (the model alike: 2.33)."
        in told[0]
    )
    assert told[0].endswith("They agree.") and told[1].endswith("They do not agree.")
    assert "which stick up to 1 rad/s" in told[1]
    vague = replace(family().bifurcations[0], passed=None)
    (open_,) = bifurcation_sentences(replace(family(), bifurcations=(vague,), hopf=None))
    assert open_.endswith("They are not told apart: too little is known of them.")
    json.dumps(family().to_dict(), allow_nan=False)


class Reader(HTMLParser):
    """Collects what must hold in the page: tags that match, ids, references, text."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.outside: list[str] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in VOID:
            self.open.append(tag)
        self.handle_startendtag(tag, attrs)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name == "id":
                self.ids.append(value or "")
            if name in ("src", "href", "xlink:href") and value and not value.startswith("#"):
                self.outside.append(value)

    def handle_endtag(self, tag: str) -> None:
        assert self.open and self.open[-1] == tag, (tag, self.open[-5:], self.getpos())
        self.open.pop()

    def handle_data(self, data: str) -> None:
        if self.open[-1:] != ["style"]:
            self.text += data


def findings() -> RigFindings:
    white = Whiteness(
        (LogResiduals("slow", 100, 0.01, 0.5, 0.4),), (SpeedResidual(0.05, 0.01, 0.5), SpeedResidual(0.1, 0.2, 4.0))
    )
    fit = replace(
        made_fit(),
        whiteness=white,
        warnings=("look <here> & there",),
        logs=(LogSummary("slow", (0.41,), 20, 0.02, 0.1, 20.0),),
    )
    return RigFindings(fit, (), (family(), family(discs=2)), notes=("a note",))


@pytest.fixture(scope="module")
def text() -> str:
    return page(findings())


@pytest.mark.nightly
def test_the_page_is_well_formed_and_needs_nothing_but_itself(text: str) -> None:
    reader = Reader()
    reader.feed(text)
    reader.close()
    assert reader.open == []
    assert len(reader.ids) == len(set(reader.ids))
    assert reader.outside == []
    references = set(re.findall(r'(?:url\(#|xlink:href="#)([^")]+)', text))
    assert references and references <= set(reader.ids)
    assert "@import" not in text and "url(h" not in text
    scripts = re.findall(r"<script([^>]*)>(.*?)</script>", text, flags=re.S)
    assert [attributes.strip() for attributes, _ in scripts] == ['type="application/json" id="data"']
    data = json.loads(scripts[0][1].replace("<\\/", "</"), parse_constant=pytest.fail)
    assert data["fit"] == json.loads(json.dumps(findings().fit.to_dict()))
    assert data["families"][0]["bifurcations"][0]["predicted"]["speed"] == 2.38
    assert text.count("<svg") == 6  # three at a glance; friction, residuals, family


def test_the_page_says_what_was_found(text: str) -> None:
    reader = Reader()
    reader.feed(text)
    for shown in (
        *("mu_s", "0.65", "s/m", "look <here> & there", "a note", "paper/rubber", "rigid contact"),
        *("agrees with the measured motion at 2 of 3 drive speeds", "the model misses something", "a < b"),
        *("They agree.", "Casini", "How to cite", "Assumptions", "Correlations", "Rig constants"),
    ):
        assert shown in reader.text, shown


def test_a_page_is_written_whole_and_replaces_nothing(tmp_path: Path) -> None:
    bare = RigFindings(made_fit(), (), ())
    target = write_report(bare, tmp_path / "report.html")
    assert target.read_text("utf-8").rstrip().endswith("</html>")
    with pytest.raises(StickslipError, match="exists"):
        write_report(bare, target)
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


@pytest.mark.nightly
def test_ids_of_an_inline_figure_have_its_prefix() -> None:
    svg = inline_svg(family_figure(family()), "one", 'what "it" shows')
    assert svg.startswith("<svg") and svg.endswith("</svg>")
    assert all(name.startswith("one-") for name in re.findall(r'\bid="([^"]*)"', svg))
    assert 'aria-label="what &quot;it&quot; shows"' in svg
    assert "<metadata" not in svg and "width=" not in svg[: svg.index(">")]


def test_the_figure_of_residuals_without_their_order_has_means_by_slip_speed_alone() -> None:
    (axes,) = residual_figure(findings().fit, None).axes
    (means,) = (line for line in axes.lines if line.get_marker() == "o")
    assert np.asarray(means.get_xdata()).tolist() == [0.05, 0.1]
    assert np.asarray(means.get_ydata()).tolist() == [0.01, 0.2]
    # a mean of 4 standard errors leaves zero, one of half of one does not
    ends = [tuple(segment[:, 1]) for one in axes.containers for segment in one.lines[2][0].get_segments()]  # type: ignore[attr-defined]
    assert [low < 0 < high for low, high in ends] == [True, False]


def test_correlation_of_residuals_stays_within_clusters() -> None:
    # each cluster alternates; the first value of one would follow the last of the other with the same sign
    residual = np.array([1.0, -1.0, 1.0, 1.0, -1.0, 1.0])
    found = correlations(residual, np.array([0, 0, 0, 1, 1, 1]))
    np.testing.assert_allclose(found, [-1.0, 1.0])
