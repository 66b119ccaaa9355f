"""Measured logs of other laboratories: published values, and what is to be thought of them.

The logs are not part of the project; without them these tests are skipped. Sources stand in the recipes.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from benchmark_scripts import benchmark_script
from known_deviation import deviation
from recipe_fit import inverse_dynamics

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.load import load
from identification.calibration.calibrate import calibrate
from identification.machines.by_recipe import recipe_machine
from identification.machines.inverse import identify_machine
from identification.machines.machine_fit import MachineFit
from identification.machines.predicted import fitted_efforts
from identification.measurement.recipe import read_recipe
from identification.slips.block_on_belt import fit_slip_model
from identification.slips.statistics import slip_statistics

DATA = Path(__file__).parents[2].parent / "shared" / "data"
EMPS = DATA / "emps" / "DATA_EMPS.mat"
PENDULUM = DATA / "dfki_simple_pendulum" / "system_identification_measured.csv"
PENDULUM_UNSEEN = DATA / "dfki_simple_pendulum" / "gravity_compensation_measured.csv"
PAPER = DATA / "lyon_stickslip"


def measured(path: Path) -> Path:
    if not path.exists():
        pytest.skip(f"the measured log {path.name} is not here: it is shared beside the project, not in it")
    return path


def shown(value: float, digits: int) -> str:
    return f"{value:.{digits}f}"


@pytest.fixture(scope="module")
def emps() -> MachineFit:
    return inverse_dynamics(read_recipe("emps"), measured(EMPS))


def test_the_positioning_system_has_the_published_values_to_every_digit(emps):
    published = {"M": "95.1089", "Fv": "203.5034", "Fc": "20.3935", "offset": "-3.1648"}
    assert {e.name: shown(e.value, 4) for e in emps.parameters} == published
    assert shown(100 * emps.joints[0].seen.relative_error, 4) == "4.0834"
    assert shown(emps.raw_condition, 3) == "25.988"


@pytest.mark.nightly
def test_in_its_loop_it_has_the_mass_that_inverse_dynamics_published():
    """By calibration of the closed loop, whose speed is late: 8.6 kg are missing where it is not. Each value is
    within a deviation of what was published."""
    measured(EMPS)
    case = benchmark_script("calibrated_machines").MACHINES["emps"]
    log, _ = case.log(DATA)
    found = calibrate(load(case.model), log, free=list(case.free), parameters=dict(case.free), guesses=1, attempts=1)
    for name, published in (("M", 95.1089), ("Fv", 203.5034), ("Fc", 20.3935), ("off", 3.1648)):
        assert abs(found[name].value - published) < deviation(found[name])
    assert deviation(found["M"]) < 0.5 and found.residuals[0].rms < 1.1 * case.reached


def test_its_standard_deviations_are_larger_than_published(emps):
    """Independent estimates of the factors, from Newey and West with 100 lags: 2.1, 6, 4.6, 5."""
    factors = {e.name: e.factor for e in emps.parameters}
    assert factors == pytest.approx({"M": 2.1, "Fv": 6.0, "Fc": 4.6, "offset": 5.0}, rel=0.25)
    assert any("coloured" in verdict for verdict in emps.verdicts)


def test_its_friction_rises_with_speed_so_contis_law_is_put_aside():
    recipe = read_recipe("emps")
    recipe.document.data["friction"]["compare"] = ["Coulomb", "Coulomb+viscous", "Conti"]
    run = inverse_dynamics(recipe, measured(EMPS))
    laws = run.laws["position"]
    rows = {row.law: row for row in laws.scores}
    assert laws.preferred == "Coulomb+viscous"
    assert rows["Conti"].values["F_s"] < rows["Conti"].values["F_k"]
    (aside,) = [said for said in run.verdicts if "Conti is put aside" in said]
    assert "friction rises with slip speed" in aside
    # an offset and mass of its own: the linear law is the published model
    (piece,) = fitted_efforts(run)
    effort = float(np.sqrt(np.mean(piece.measured**2)))
    assert rows["Coulomb+viscous"].rms / effort == pytest.approx(0.040834, abs=5e-7)


def test_its_viscous_friction_depends_on_the_direction(emps):
    by_direction = inverse_dynamics(read_recipe("emps_by_direction"), measured(EMPS))
    plus, minus = by_direction["Fv_plus"].value, by_direction["Fv_minus"].value
    deviation = max(e.standard_deviation for e in by_direction.parameters if e.name.startswith("Fv"))
    assert minus - plus > 10 * deviation
    (one,), (other,) = by_direction.joints, emps.joints
    assert one.seen.relative_error < 0.8 * other.seen.relative_error
    assert one.left_out.relative_error < 0.8 * other.left_out.relative_error
    assert emps.laws["position"].preferred == "Coulomb+viscous by direction"


def test_the_pendulum_has_the_published_values_and_is_flagged_as_poor():
    result = inverse_dynamics(read_recipe("dfki_simple_pendulum"), measured(PENDULUM), [measured(PENDULUM_UNSEEN)])
    published = {"J": 0.06259, "m_cx": 0.1022, "Fv": 0.04707, "Fc": 0.1839, "offset": -0.07586}
    for name, value in published.items():
        assert f"{result[name].value:.3e}" == f"{value:.3e}"
    assert f"{100 * (1 - result.joints[0].seen.relative_error):.0f}" == "25"
    assert "Poor fit" in result.verdicts[0] and "fits 25 %" in result.verdicts[0]
    assert "reproduced does not make them valid" in result.verdicts[0]
    assert result.joints[0].held_out[PENDULUM_UNSEEN.name].explained < 0.35
    assert any("Fc cannot be told from zero" in verdict for verdict in result.verdicts)


def test_instruments_find_the_pendulum_that_least_squares_at_the_published_filters_does_not():
    """J/(m cx) of a mass at the end of a light rod is its length, 0.5 m; the published values say 0.61 m, and their
    model explains a third of the unseen log at most."""
    axis = recipe_machine(read_recipe("dfki_simple_pendulum"))
    log, unseen = axis.logs([measured(PENDULUM), measured(PENDULUM_UNSEEN)])
    low, high = (identify_machine(axis.mechanism, [log], cutoff=cutoff, held_out=[unseen]) for cutoff in (10.0, 20.0))
    assert low["J"].value / low["m_cx"].value == pytest.approx(0.5, rel=0.03)
    assert high["J"].value == pytest.approx(low["J"].value, rel=0.05)
    assert high["J"].least_squares < 0.25 * high["J"].value
    assert low.joints[0].held_out[unseen.name].relative_error < 0.15


def test_paper_on_paper_has_the_known_slip_statistics():
    statistics, _ = slip_statistics(
        read_recipe("lyon_stick_slip"), measured(PAPER / "k168Nm_v42.mat"), {"stiffness": 168, "speed": 42e-6}
    )
    assert statistics.events == pytest.approx(194, rel=0.03)
    assert statistics.peak.value == pytest.approx(0.324, rel=0.03)
    assert statistics.after.value == pytest.approx(0.281, rel=0.03)
    assert statistics.period.value == pytest.approx(1.90, rel=0.03)
    assert statistics.period_variation == pytest.approx(0.34, rel=0.03)
    assert statistics.loading == pytest.approx(statistics.loading_expected, rel=0.1)
    model = fit_slip_model(statistics)
    assert model is not None
    # the period was not fitted
    assert model.predictions[2].ratio == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize(
    ("name", "stiffness", "speed"),
    [("k168Nm_v1100", 168, 1100e-6), ("k168Nm_v4300", 168, 4300e-6), ("k1002Nm_v1100", 1002, 1100e-6)],
)
def test_the_same_recipe_serves_other_springs_and_speeds(name, stiffness, speed):
    """Loading gives the spring back, and one block on a belt the order of every period."""
    statistics, _ = slip_statistics(
        read_recipe("lyon_stick_slip"), measured(PAPER / f"{name}.mat"), {"stiffness": stiffness, "speed": speed}
    )
    assert statistics.events > 40
    assert 0.2 < statistics.after.value < statistics.peak.value < 0.6
    assert statistics.loading == pytest.approx(statistics.loading_expected, rel=0.15)
    if speed > 2e-3:
        # at 4.3 mm/s a period is the natural one: the slider swings
        assert any("inertial regime" in verdict for verdict in statistics.verdicts)
        with pytest.raises(StickslipError, match="as fast as the slider swings"):
            fit_slip_model(statistics)
        return
    model = fit_slip_model(statistics)
    assert model is not None and model.mu_s > model.mu_k
    assert model.predictions[2].ratio == pytest.approx(1.0, abs=0.15)


def test_slips_are_counted_by_either_definition():
    """The authors' detector of falling pieces counts 116 on this log."""
    recipe, log = read_recipe("lyon_stick_slip"), measured(PAPER / "k168Nm_v1100.mat")
    known = {"stiffness": 168, "speed": 1100e-6}
    assert slip_statistics(recipe, log, known)[0].events == 81
    assert slip_statistics(recipe, log, known, definition="every")[0].events == pytest.approx(116, abs=3)
