"""Pictures as a person sees them: nothing cut off, labels apart, legends for what is drawn and beside the data."""

from __future__ import annotations

import itertools
import re
from dataclasses import replace
from html import unescape

import numpy as np
import pytest
from made_fit import made_fit
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text
from scene_file import CLASS_A, scene_of

import fmu_models.report.views  # noqa: F401  registers what it draws
from fmu_models.analyses.section import PoincareSection
from fmu_models.base import shown
from fmu_models.base.figures import part_ticks, save_figure
from fmu_models.report.inline_svg import inline_svg
from fmu_models.report.scene_figure import draw, draw_families
from fmu_models.scene.kinds.kind import Row
from fmu_models.simulation.trajectory import Trajectory
from fmu_models.validation.stress.cases import Case
from fmu_models.validation.stress.judge import StressCell
from fmu_models.validation.stress.report import heat_map
from identification.estimators.savitzky_golay import FrictionSamples
from identification.fit.parts import LogSummary, SpeedBin
from identification.laws import find_law
from identification.report.friction_figure import friction_figure


def cells(model: str, names: list[str], **changes) -> list[StressCell]:
    return [
        StressCell(Case(model, "stop", "stiffness", name, **changes), "accurate", 1e-12, "energy", "") for name in names
    ]


def friction(discs: int = 1) -> Figure:
    fit = made_fit(discs=discs)
    parameters = tuple(replace(q, scale_deviation=0.02 * q.value) for q in fit.parameters)
    logs = (LogSummary("slow", (0.41,), 20, 0.02, 0.1, 20.0), LogSummary("fast", (0.83,), 21, 0.02, 0.2, 20.0))
    bins = (SpeedBin(0.05, 0.52, 0.001, 0.521, 40),)
    slip, log = np.linspace(0.02, 0.2, 60), np.repeat([0, 1], 30)
    mu = find_law("Conti").value(slip, fit.law_values[:3]) + 0.01 * np.sin(40 * slip)
    seen = FrictionSamples(slip, mu, log, log, np.ones(60))
    return friction_figure(replace(fit, parameters=parameters, logs=logs, bins=bins), dict.fromkeys(fit.contacts, seen))


def narrow() -> Figure:
    """Labels that touch as matplotlib would draw them."""
    figure = Figure(figsize=(4.0, 3.0), layout="constrained")
    axes = figure.subplots()
    axes.plot([0.0, 0.18], [1.0, 2.0])
    axes.set_xlabel("x (m)")
    return figure


FIGURES = {
    "friction": friction,
    "two discs": lambda: friction(2),
    "few cases": lambda: heat_map(cells("discontinuous_support", [f"ks=1e+{i:02d}" for i in range(6)])),
    "one case": lambda: heat_map(cells("discontinuous_support", ["ks=0"])),
    "narrow": narrow,
}


def shown_texts(figure: Figure) -> list[Text]:
    """Texts that are drawn: of ticks only those within the axes."""
    figure.draw_without_rendering()
    hidden = set()
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
            hidden |= {one for tick in ticks if not low <= tick.get_loc() <= high for one in (tick.label1, tick.label2)}
    texts = [text for text in figure.findobj(Text) if isinstance(text, Text) and text.get_visible()]
    return [text for text in texts if text.get_text() and text not in hidden]


@pytest.mark.parametrize("name", FIGURES)
def test_no_text_is_cut_off_and_no_labels_touch(name):
    figure = FIGURES[name]()
    part_ticks(figure)
    texts = shown_texts(figure)
    for text in texts:
        box = text.get_window_extent()
        assert box.x0 >= -1 and box.y0 >= -1, text.get_text()
        assert box.x1 <= figure.bbox.x1 + 1 and box.y1 <= figure.bbox.y1 + 1, text.get_text()
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            boxes = [label.get_window_extent() for label in axis.get_ticklabels() if label in texts]
            upright = [label for label in axis.get_ticklabels() if label in texts and label.get_rotation() == 0]
            if len(upright) == len(boxes):
                assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))


def test_text_of_files_is_text(tmp_path):
    """In the PDF glyphs of a font that readers know (type 42), with the table by which they are letters again."""
    svg = save_figure(narrow(), tmp_path / "one.svg").read_text()
    assert re.search(r"<text[^>]*>x \(m\)</text>", svg)
    pdf = save_figure(narrow(), tmp_path / "one.pdf").read_bytes()
    assert b"/CIDFontType2" in pdf and b"/ToUnicode" in pdf and b"/Type3" not in pdf


def test_labels_that_touch_are_fewer():
    figure = narrow()
    figure.draw_without_rendering()
    before = len(figure.axes[0].get_xticks())
    part_ticks(figure)
    assert 2 <= len(figure.axes[0].get_xticks()) < before


def test_where_little_fits_two_intervals_or_fewer_are_labelled():
    """Eight digits are wider than a third of the axis."""
    figure = Figure(figsize=(2.6, 3.0), layout="constrained")
    figure.subplots().plot([1e7, 9e7], [1.0, 2.0])
    figure.axes[0].ticklabel_format(style="plain", axis="x")
    part_ticks(figure)
    boxes = [text.get_window_extent() for text in figure.axes[0].get_xticklabels() if text in shown_texts(figure)]
    assert boxes and not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_in_a_page_says_what_was_drawn(name):
    figure = FIGURES[name]()
    svg = inline_svg(figure, "one", "what it shows")
    read = [unescape(text).strip() for text in re.findall(r"<text[^>]*>(.*?)</text>", svg, flags=re.S)]
    drawn = [line for text in shown_texts(figure) for line in text.get_text().split("\n")]
    assert sorted(read) == sorted(drawn)


def test_texts_of_a_figure_in_a_page_are_never_smaller_than_twelve_pixels():
    figure = Figure(figsize=(5.0, 3.0))
    figure.text(0.5, 0.5, "ten points", fontsize=10)
    figure.text(0.5, 0.8, "twenty", fontsize=20)
    assert 'style="min-width: 432px"' in inline_svg(figure, "one", "what it shows")  # 360 points, of 10 px to 12


def test_drawn_lines_are_shortened():
    figure = narrow()
    svg = inline_svg(figure, "one", "what it shows")
    (line,) = re.findall(r'<path d="(M [^"]*?)"[^>]*clip-path', svg)
    assert re.findall(r"\.(\d+)", line) and all(len(places) <= 2 for places in re.findall(r"\.(\d+)", line))


def test_the_title_has_both_kinds_of_deviation():
    title = friction().axes[0].get_title()
    # 0.1 % from noise and 2 % from the constants
    assert "mu_s = 0.650 ± 0.013" in title and "p = 15.00 ± 0.30 s/m" in title and "together" in title


def test_legends_leave_residuals_alone():
    figure = friction()
    figure.draw_without_rendering()
    legend = figure.axes[1].get_legend()
    assert isinstance(legend, Legend)
    assert not legend.get_window_extent().overlaps(figure.axes[1].get_window_extent())


def test_few_cases_have_a_column_each_and_many_share_one():
    few = heat_map(cells("a", ["ks=0", "ks=10", "ks=1e+12"]))
    assert [label.get_text() for label in few.axes[0].get_xticklabels()] == ["ks=0", "ks=10", "ks=1e+12"]
    many = heat_map(cells("a", [f"ks={i}" for i in range(40)]))
    assert [label.get_text() for label in many.axes[0].get_xticklabels()] == ["stop stiffness"]


def test_a_heat_map_explains_only_the_marks_it_has():
    plain = heat_map(cells("a", ["ks=0"])).axes[0].get_title()
    assert "refused" not in plain and "failed" not in plain and "grey" not in plain
    (cell,) = cells("a", ["ks=1"])
    refused = heat_map([*cells("a", ["ks=0"]), replace(cell, verdict="refused", error=None)]).axes[0].get_title()
    assert "r: some refused" in refused and "failed" not in refused and "grey" in refused


def test_panels_at_the_edge_have_labels_with_units(tmp_path, monkeypatch):
    turn = np.linspace(0, 2 * np.pi, 50)
    values, units = {"x": np.cos(turn), "v": np.sin(turn)}, {"x": "m", "v": "m/s"}
    trajectory = Trajectory(turn, values, units, (), 1, 1)
    drawn = []
    monkeypatch.setattr("fmu_models.report.scene_figure.save_figure", lambda figure, path, **_: drawn.append(figure))
    draw("five of six", [(f"w = {i}", trajectory) for i in range(5)], ("x", "v"), tmp_path / "a.png")
    save_figure(drawn[0], tmp_path / "a.png")
    panels = drawn[0].axes[:5]
    assert [bool(axes.get_xlabel()) for axes in panels] == [False, False, True, True, True]
    texts = shown_texts(drawn[0])
    for axes in panels:
        labelled = any(label in texts for label in axes.get_xticklabels())
        assert labelled == bool(axes.get_xlabel())
        assert axes.get_xlabel() in ("", "$x$ (m)") and axes.get_ylabel() in ("", "$v$ (m/s)")


FAMILY = '[compute]\nkind = "lyapunov"\nperiod = 1\nover = "w0"\nvalues = [0, 1, 2]\n'


def test_families_have_a_panel_each(tmp_path, monkeypatch):
    section = PoincareSection("drawn", ("a", "b"), (), np.zeros((3, 2)), np.ones(3), np.zeros((3, 0), np.int32))
    rows = [Row(at=float(i), values={}, family=replace(section)) for i in range(3)]
    drawn = []
    monkeypatch.setattr("fmu_models.report.scene_figure.save_figure", lambda figure, path, **_: drawn.append(figure))
    draw_families(scene_of(tmp_path, CLASS_A + FAMILY), rows, tmp_path / "a.png")
    assert [(axes.get_title(), axes.axison) for axes in drawn[0].axes] == [
        *((f"$w_{{0}}$ = {i} rad/s", True) for i in range(3)),
        ("", False),  # of two in a row
    ]


@pytest.mark.parametrize("count", [3, 300])
def test_a_section_is_drawn_by_its_first_two_states(count):
    points = np.random.default_rng(4).random((count, 3))
    section = PoincareSection("drawn", ("a", "b", "c"), (), points, np.ones(count), np.zeros((count, 0), np.int32))
    axes = Figure().subplots()
    shown.draw(section, axes)
    (line,) = axes.lines
    np.testing.assert_array_equal(np.column_stack(line.get_data()), points[:, :2])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("$a$", "$b$")
