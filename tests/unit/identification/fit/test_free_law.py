"""Friction as a curve through values: a law like any other, from a bench that shares no code with us."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from foreign_bench import foreign_logs, with_drawn_constants
from oracle.bench import Bench

from fmu_models.base.errors import StickslipError
from fmu_models.simulation.run import simulate
from identification.estimators.base import Options
from identification.fit.fit import fit_friction
from identification.fit.result import FrictionFit, read_fit
from identification.fitted_model.model import fitted_model, inputs
from identification.laws import find_law, slip_laws
from identification.measurement.pooling import pool
from identification.report.friction_figure import fitted_law
from rig_io.logs.log import RigLog

RNG = np.random.default_rng(2)
FALL, SLOPE, BUMP, PLACE = (float(RNG.uniform(*ends)) for ends in ((0.15, 0.3), (10, 25), (-0.03, 0.03), (0.05, 0.15)))


def drawn(speed: np.ndarray) -> np.ndarray:
    """A law that is none of ours."""
    return 0.33 + FALL / (1 + SLOPE * speed) + BUMP * np.exp(-(((speed - PLACE) / 0.06) ** 2)) + 0.1 * speed


@pytest.fixture(scope="module")
def logs() -> list[RigLog]:
    bench = with_drawn_constants(Bench(lambda speed: float(drawn(np.array(speed)))), np.random.default_rng(5))
    return foreign_logs(bench, 5, (0.41, 0.83))


@pytest.fixture(scope="module")
def fit(logs: list[RigLog]) -> FrictionFit:
    return fit_friction(logs, law="free", disturbances="none")


def test_a_drawn_law_is_recovered(fit: FrictionFit) -> None:
    law, speed = fitted_law(fit, "disc0"), np.linspace(0.008, fit["v_end"].value, 300)
    share = law(speed) / drawn(speed)
    scale = float(np.median(share))  # that of N, R and k, of which nothing in slips tells
    assert scale == pytest.approx(1.0, abs=0.015)
    assert np.sqrt(np.mean((share / scale - 1) ** 2)) < 3e-3
    rest = fit["mu_0"]
    assert rest.value / scale == pytest.approx(float(drawn(np.array(0.0))), rel=0.01)
    assert 0 < rest.standard_deviation < 0.02 and rest.scale_deviation > 0
    assert fit["v_end"].held and not fit.causes and fit.converged
    assert np.array(fit.correlation).shape == (10, 10)


def test_the_model_of_a_fit_that_was_read_slips_on_the_curve(fit: FrictionFit, tmp_path: Path) -> None:
    path = tmp_path / "fit.json"
    path.write_text(fit.to_json(), encoding="utf-8")
    again = read_fit(path)
    assert again == replace(fit, solved=None, recorded=()) and again.law == "free" and again.declaration == ""
    model = fitted_model(again)
    values = model.parameters
    run = simulate(
        model.fmu,
        2.0,
        parameters=values,
        start={"theta": 0.0, "omega": 0.0},
        inputs=inputs({"disc0": 0.83}),
        output_times=np.linspace(0, 2, 500),
    )
    slip = values["r"] * 0.83 - values["R"] * run["omega"]
    slips = run["disc0_state"] != 0
    torque = values["J"] * run["der(omega)"] + values["c"] * run["omega"] + values["k"] * run["theta"]
    friction = np.sign(slip) * torque / (values["R"] * values["N0"])
    assert again.free is not None and np.count_nonzero(slips) > 100
    np.testing.assert_allclose(friction[slips], again.free.at(np.abs(slip[slips])), rtol=1e-9)


def test_it_is_no_law_of_a_contest_and_takes_nothing_beside_it(logs: list[RigLog]) -> None:
    assert find_law("free").spans == "v_end" and "free" not in slip_laws()
    with pytest.raises(StickslipError, match="fitted by 'shooting', not by 'weak-form'"):
        fit_friction(logs, law="free", estimator="weak-form")
    with pytest.raises(StickslipError, match="nothing is held or estimated beside it"):
        fit_friction(logs, law="free", options=Options(nuisance=("zero",)))
    with pytest.raises(StickslipError, match="needs slips of one driving disc"):
        fit_friction(replace(pool(logs), contacts=("disc0", "disc1")), law="free")
