"""What values show of themselves: a few lines, no array and no numpy scalar; frames, data sets, axes."""

from __future__ import annotations

import sys
from collections.abc import Iterator

import matplotlib as mpl
import numpy as np
import pytest
from checkout import ROOT
from matplotlib import pyplot
from matplotlib.figure import Figure
from recipe_fit import inverse_dynamics

from fmu_models import (
    SensitiveRun,
    StickslipError,
    Trajectory,
    find_crossings,
    find_orbit,
    load,
    read_scene,
    read_system,
    simulate,
)
from fmu_models.analyses.section import PoincareSection
from fmu_models.base.shown import Tabular
from fmu_models.maps import henon
from fmu_models.oscillators import block_on_belt, planar_hopf
from identification import (
    compare_families,
    compare_laws,
    design,
    fit_free_decay,
    fit_friction,
    read_recipe,
    slip_statistics,
)
from rig_io import emulate, standard_set

LINES, WIDTH = 10, 130
MACHINES = ROOT / "data" / "machines"


@pytest.fixture(autouse=True)
def no_screen() -> Iterator[None]:
    before = mpl.get_backend()
    mpl.use("agg")
    yield
    pyplot.close("all")
    mpl.use(before)


@pytest.fixture(scope="module")
def run() -> Trajectory:
    return simulate(load("disc_rig", contacts=["disc0"]), 5.0, inputs={"w0": 0.41}, start={"theta": 0.1})


@pytest.fixture(scope="module")
def found() -> dict[str, object]:
    """Values of all kinds, made by the real thing."""
    rig, support = load("disc_rig", contacts=["disc0"]), load("discontinuous_support")
    logs = [emulate(one, 1, number) for number, one in enumerate(standard_set(duration=8.0))]
    fit = fit_friction(logs, estimator="weak-form")
    with SensitiveRun(rig, by=["mu_s0", "theta"]) as runs:
        sensitive = repr(runs), runs.run([0.5, 1.0], inputs={"w0": 0.41})
    family = compare_families(fit, logs, uncertainty=False)[0]
    return {
        "fmu": rig,
        "mechanism": block_on_belt.MODEL,
        "contact": block_on_belt.belt,
        "automaton": planar_hopf.MODEL,
        "map": henon.MAP,
        "sensitive run": sensitive[0],
        "sensitivity": sensitive[1],
        "orbit": find_orbit(support, 6.283185307179586, {"x": 3.6, "v": 2.5}),
        "crossings": find_crossings(lambda x: np.cos(x) if x < 1.2 else 1.5, 0.0, 1.4),
        "scene": read_scene("disc_rig_class_a"),
        "system": read_system("disc_rig_motors"),
        "log": logs[0],
        "emulation": standard_set()[0],
        "decay": fit_free_decay(logs[-1]),
        "fit": fit,
        "parameter": fit["mu_s"],
        "family": family,
        "portrait": family.members[0],
        "laws": compare_laws(logs, ("Conti", "Coulomb")),
        "inverse": inverse_dynamics(read_recipe("axis"), MACHINES / "axis.csv"),
        "slips": slip_statistics(read_recipe("slider"), MACHINES / "slider.csv", {"stiffness": 50.0})[0],
        "design": design(fit, speeds=[0.5], loads=[4.905]),
    }


@pytest.mark.nightly
def test_a_repr_is_short_and_says_what_it_is(found, run):
    for what, value in {**found, "run": run}.items():
        said = value if isinstance(value, str) else repr(value)
        assert len(said.splitlines()) <= LINES, f"{what}:\n{said}"
        assert max(map(len, said.splitlines())) <= WIDTH, f"{what}:\n{said}"
        assert "np." not in said and "array(" not in said and " at 0x" not in said, f"{what}:\n{said}"
    assert "disc_rig" in repr(found["fmu"]) and "Conti law of disc0" in repr(found["fit"])
    assert repr(run).startswith("Trajectory: 1001 times from 0 to 5 s")


def test_a_notebook_gets_a_table_and_no_markup_of_others(found, run):
    for value in (*found.values(), run):
        if not isinstance(value, str):
            assert "<table" in value._repr_html_()
    named = Trajectory(np.zeros(1), {"<b>": np.zeros(1)}, {"<b>": "1"}, (), 0, 0, "<script>")
    assert "<script>" not in named._repr_html_() and "<b>" not in named._repr_html_()


def test_frames_hold_the_numbers(found, run):
    assert run.frame.index.name == "time" and np.array_equal(run.frame["theta"], run["theta"])
    fit = found["fit"]
    assert fit.frame.loc["mu_s", "value"] == fit["mu_s"].value
    assert (fit.frame.loc["p", "low"], fit.frame.loc["p", "high"]) == fit.interval("p")
    assert found["laws"].frame.loc["Conti", "bic"] == found["laws"].best.bic
    assert list(found["family"].frame.index) == [one.log for one in found["family"].members]
    assert found["inverse"].frame.loc["M", "value"] == found["inverse"]["M"].value
    assert found["slips"].frame.loc["period", "value"] == found["slips"].period.value
    assert np.array_equal(found["log"].frame["laser"], found["log"].column("laser"))
    sensitivity = found["sensitivity"]
    assert np.array_equal(sensitivity.frame["d omega/d mu_s0"], sensitivity.of("omega")[:, 0])


def test_data_sets_have_the_units(found, run):
    data = run.to_xarray()
    assert data["theta"].attrs["units"] == "rad" and data["time"].attrs["units"] == "s"
    assert np.array_equal(data["theta"], run["theta"])
    for value in found.values():
        if isinstance(value, Tabular):
            assert dict(value.to_xarray().sizes)


def test_without_xarray_the_error_says_how_to_get_it(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(StickslipError, match=r"pip install 'stickslip\[xarray\]'"):
        run.to_xarray()


def test_plots_are_drawn_in_the_axes_given_or_in_new_ones(found, run):
    for value in (run, found["fit"], found["family"], found["portrait"], found["laws"], found["inverse"]):
        axes = Figure().subplots()
        assert value.plot(ax=axes) is axes and axes.has_data()
        assert axes.get_xlabel()
        assert value.plot().has_data()
    axes = run.plot("theta:omega")
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("theta (rad)", "omega (rad/s)")
    assert np.array_equal(axes.lines[0].get_xdata(), run["theta"])
    with pytest.raises(StickslipError, match="no variable 'thet'"):
        run.plot("thet")


@pytest.mark.parametrize(
    ("states", "count"), [(("x",), 3), (("x", "v", "z"), 3), (("x", "v"), 400), (("x", "v"), 30_000)]
)
def test_a_section_is_drawn_by_its_first_two_states(states: tuple[str, ...], count: int) -> None:
    points = np.random.default_rng(1).normal(size=(count, len(states))) + 10.0 * np.arange(len(states))
    section = PoincareSection("rig", states, (), points, np.ones(count), np.zeros((count, 0), np.int32))
    axes = section.plot(ax=Figure().subplots())
    assert (axes.get_xlabel(), axes.get_ylabel()) == (f"${states[0]}$", f"${states[:2][-1]}$")
    across, up = points[:, 0], points[:, :2][:, -1]
    if count > 10_000:  # counts in cells
        centres = np.asarray(axes.collections[0].get_offsets())
        assert np.allclose(np.ptp(centres, axis=0), (np.ptp(across), np.ptp(up)), atol=0.3)
        assert np.allclose(centres.min(axis=0), (across.min(), up.min()), atol=0.3)
    else:
        assert np.array_equal(axes.lines[0].get_xydata(), np.column_stack((across, up)))


def test_the_summary_of_a_fit_is_what_the_terminal_says_in_a_notebook_too(found, monkeypatch):
    monkeypatch.setattr("rich.console._is_jupyter", lambda: True)
    monkeypatch.setenv("FORCE_COLOR", "1")  # as kernels do
    said = found["fit"].summary()
    assert "\x1b" not in said
    for part in ("mu_s", "Correlations", "Assumed: ", "rig constants"):
        assert part.lower() in said.lower()
    assert found["laws"].verdict in found["laws"].summary()
    assert found["family"].members[0].log in found["family"].summary()
