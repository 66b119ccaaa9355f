"""What a figure of a run shows: read from the figure itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built
from fmu_models.coupling.run import couple
from fmu_models.coupling.toml_system import read_system
from fmu_models.fmu.fmu import Fmu
from fmu_models.report.trajectory_figure import trajectory_figure
from fmu_models.simulation.beside import Beside
from fmu_models.simulation.measured import MeasuredLog
from fmu_models.simulation.run import simulate


def drawn(model: str, end: float, plots: tuple[str, ...] = (), **options: Any) -> tuple[Figure, Any]:
    fmu = Fmu.open(built(model))
    run = simulate(fmu, end, output_times=np.linspace(0.0, end, 501), **options)
    return trajectory_figure(run, fmu, plots), run


def labels(figure: Figure) -> list[tuple[str, str]]:
    return [(axes.get_xlabel(), axes.get_ylabel()) for axes in figure.axes]


def marks(figure: Figure) -> list[str]:
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def test_every_coordinate_has_its_portrait_and_its_series():
    figure, run = drawn("woodpecker", 0.3)
    pairs = (
        ("$y$ (m)", "$v$ (m/s)"),
        (r"$\phi_{M}$ (rad)", "$w_{M}$ (rad/s)"),
        (r"$\phi_{S}$ (rad)", "$w_{S}$ (rad/s)"),
    )
    assert labels(figure) == [
        *(panel for q, v in pairs for panel in ((q, v), ("", q), ("", v))),
        ("time (s)", ""),  # the contacts
    ]
    np.testing.assert_array_equal(figure.axes[3].lines[0].get_xydata(), np.stack([run["phi_M"], run["w_M"]], 1))
    np.testing.assert_array_equal(figure.axes[7].lines[0].get_ydata(), run["phi_S"])
    assert marks(figure) == ["start", "contact", "stick"]
    assert {text.get_text() for text in figure.axes[-1].get_yticklabels()} == {"lower", "lower_friction", "upper"}


def test_stick_is_shaded_where_it_is():
    figure, run = drawn("block_on_belt", 5.0)
    spans = [(p.get_x(), p.get_x() + p.get_width()) for p in figure.axes[1].patches if isinstance(p, Rectangle)]
    inside = np.any([(begin <= run.time) & (run.time < end) for begin, end in spans], axis=0)
    np.testing.assert_array_equal(inside[:-1], (run["belt_state"] == 0)[:-1])
    assert marks(figure) == ["start", "stick"] and len(figure.axes) == 3


def test_touching_a_stop_is_shaded():
    figure, run = drawn("discontinuous_support", 20.0)
    assert (run["support_state"] == 3).any() and marks(figure) == ["start", "contact"]


def test_states_of_a_contact_are_words_and_go_from_event_to_event():
    """Away, in contact, let go: the subspaces of the support and where their surfaces are met."""
    figure, run = drawn("discontinuous_support", 6.0, ("support_state", "x"))
    axes = figure.axes[0]
    dots, line = axes.lines
    np.testing.assert_array_equal(dots.get_xydata(), [(event.time, event.after) for event in run.events])
    assert np.asarray(line.get_ydata()).tolist() == [2, 3, 4, 2, 2] and line.get_drawstyle() == "steps-post"
    assert [text.get_text() for text in axes.get_yticklabels()] == ["away", "touching", "released"]
    assert [name for _, name in labels(figure)] == ["support_state", "$x$ (m)"]


def test_two_states_without_a_coordinate_are_a_plane_and_one_alone_is_a_series():
    assert labels(drawn("planar_hopf", 3.0)[0])[0] == ("$x_{1}$", "$x_{2}$")


def test_what_is_asked_for():
    figure, run = drawn("woodpecker", 0.3, ("y, phi_M,phi_S", "phi_S:w_S", "time:y", "phi_M:w_M", "y:v"))
    assert labels(figure) == [
        ("", "$y$ (m)"),
        ("", "rad"),
        ("time (s)", ""),
        (r"$\phi_{S}$ (rad)", "$w_{S}$ (rad/s)"),
        ("time (s)", "$y$ (m)"),
        (r"$\phi_{M}$ (rad)", "$w_{M}$ (rad/s)"),
        ("$y$ (m)", "$v$ (m/s)"),
    ]
    places = [axes.get_subplotspec() for axes in figure.axes]
    # none lies on another: three portraits stand side by side
    assert [place and place.rowspan for place in places] == [range(row, row + 1) for row in (0, 1, 2, 3, 3, 3, 4)]
    legend: Any = figure.axes[1].get_legend()
    assert [text.get_text() for text in legend.get_texts()] == [r"$\phi_{M}$", r"$\phi_{S}$"]
    np.testing.assert_array_equal(figure.axes[3].lines[0].get_xydata(), np.stack([run["phi_S"], run["w_S"]], 1))


@pytest.mark.parametrize(
    ("plot", "message"),
    [
        ("theta,phi", "no variable 'theta'"),
        ("x:", "A plot is x,v"),
        ("x,,v", "A plot is x,v"),
        ("x:v:x", "A plot is x,v"),
        ("x:v,x", "A plot is x,v"),
        ("", "A plot is x,v"),
    ],
)
def test_a_plot_that_cannot_be_drawn(plot, message):
    with pytest.raises(StickslipError, match=message):
        drawn("block_on_belt", 1.0, (plot,))


@pytest.mark.parametrize(
    "model", ["block_on_belt", "woodpecker", "disc_rig", "impact_damper", "hinge_clearance", "drive_motor"]
)
def test_no_label_lies_on_another(model):
    figure, _ = drawn(model, 1.0)
    figure.draw_without_rendering()
    boxes = []
    for axes in figure.axes:
        texts = [axes.xaxis.label, axes.yaxis.label]
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            ticks = [
                tick for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high and tick.label1.get_visible()
            ]
            texts += [tick.label1 for tick in ticks]
        boxes += [(text.get_text(), text.get_window_extent()) for text in texts if text.get_text()]
    for i, (name, box) in enumerate(boxes):
        for other, place in boxes[i + 1 :]:
            assert not box.overlaps(place), f"{name} lies on {other}"


def test_what_was_measured_is_drawn_beside_the_run_over_time_and_in_its_portrait():
    run = drawn("block_on_belt", 5.0)[1]
    times = run.time[::10]
    columns = {"x": run["x"][::10] + 0.01, "v": run["v"][::10], "F": np.where(times > 1.0, run["F"][::10], np.nan)}
    measured = Beside(MeasuredLog("a log", times, columns), {}).match(run)
    figure = trajectory_figure(run, Fmu.open(built("block_on_belt")), measured=measured)
    portrait, x, v, force = figure.axes
    np.testing.assert_array_equal(portrait.lines[2].get_xydata(), np.stack([columns["x"], columns["v"]], 1))
    for axes, name in ((x, "x"), (v, "v")):
        np.testing.assert_array_equal(axes.lines[1].get_xydata(), np.stack([times, columns[name]], 1))
    assert np.size(force.lines[1].get_xdata()) == (times > 1.0).sum()  # what is no number is left out
    assert marks(figure) == ["start", "stick", "measured"]


def test_units_of_a_system_are_drawn_by_their_names():
    system = read_system("disc_rig_motors").changed(stop_time=1.0, outputs=())
    figure = trajectory_figure(couple(system), system.fmus, title="both")
    assert ("rig.theta (rad)", "rig.omega (rad/s)") in labels(figure)
    assert ("motor1.w (rad/s)", "motor1.a (rad/s2)") in labels(figure)
