"""Calibration of coupled systems, whose parameters are unit.parameter."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from coupled import exported, masses
from known_deviation import deviation

from fmu_models.base.errors import StickslipError
from fmu_models.coupling import ssp_writer
from fmu_models.coupling.run import couple
from fmu_models.coupling.system import CoupledSystem
from identification.calibration.calibrate import calibrate
from identification.calibration.subject import Stretch, Window
from identification.calibration.systems import SystemFmu, subject_of

TRUE = {"a.k": 5.0, "b.kc": 3.0}


@pytest.fixture(scope="module")
def system(tmp_path_factory) -> CoupledSystem:
    """Two masses, the first one displaced; the second one with a mass that the system states."""
    two = masses(exported("mass", tmp_path_factory.mktemp("units")), stop_time=10.0)
    return two.changed(units={**two.units, "b": replace(two.units["b"], parameters={"m": 1.5})})


def run(system: CoupledSystem, times: np.ndarray, **values: float):
    units = dict(system.units)
    for name, value in values.items():
        unit, _, variable = name.partition(".")
        units[unit] = replace(units[unit], parameters={**units[unit].parameters, variable: value})
    return couple(system.changed(units=units, tolerance=1e-10), output_times=times)


@pytest.mark.nightly
def test_parameters_of_units_are_found_from_one_measured_place(system):
    time = np.linspace(0, 8, 121)
    log = {"time": time, "a.x": run(system, time, **TRUE)["a.x"] + 0.01 * np.random.default_rng(0).normal(size=121)}
    found = calibrate(
        system, log, free=list(TRUE), parameters={"a.k": 7.5, "b.kc": 2.0}, guesses=8, attempts=1, segments=6
    )
    for name, value in TRUE.items():
        assert abs(found[name].value - value) < 4 * deviation(found[name])
        assert deviation(found[name]) < 0.03 * value
    assert found["a.k"].unit == "N/m" and found["a.x(0)"].value == pytest.approx(1.0, abs=0.02)
    assert found.residuals[0].rms == pytest.approx(0.01, rel=0.15)
    assert found.free_run()["b.x"].shape == (121,)


def file_of(system: CoupledSystem, kind: str, folder: Path) -> Path:
    """The two masses as a user has them."""
    path = folder / f"masses.{kind}"
    if kind == "ssp":
        return ssp_writer.write(path, system, ssp_writer.parameter_sets(system))
    fmu = folder / "mass.fmu"
    fmu.write_bytes(system.units["a"].fmu.path.read_bytes())
    path.write_text(f"""
        stop_time = 10.0
        connections = [{{ from = "a.place", to = "b.other" }}, {{ from = "b.place", to = "a.other" }}]
        units.a = {{ fmu = "{fmu.name}", start = {{ x = 1.0 }} }}
        units.b = {{ fmu = "{fmu.name}", parameters = {{ m = 1.5 }} }}
    """)
    return path


@pytest.mark.nightly_for("ssp")
@pytest.mark.parametrize("kind", ["toml", "ssp"])
def test_a_file_of_a_system_is_calibrated_to_its_closed_form(system, kind, tmp_path):
    """x'' = -M^-1 K x from (1, 0): x = cos(sqrt(M^-1 K) t) (1, 0). Both stiffnesses are those of the logs, to the error
    of runs at 1e-10, and so are start states."""
    stiffness = np.array([[TRUE["a.k"] + 2.5, -2.5], [-TRUE["b.kc"] / 1.5, (4.0 + TRUE["b.kc"]) / 1.5]])
    squares, modes = np.linalg.eig(stiffness)
    time = np.linspace(0, 4, 41)
    weights = np.linalg.solve(modes, [1.0, 0.0])
    place = modes @ (weights[:, None] * np.cos(np.sqrt(squares)[:, None] * time))
    log = tmp_path / "log.csv"
    np.savetxt(log, np.column_stack([time, *place]), delimiter=",", header="time,a.x,b.x", comments="")
    found = calibrate(
        str(file_of(system, kind, tmp_path)),
        [log],
        free=list(TRUE),
        parameters={"a.k": 7.5, "b.kc": 2.0},
        guesses=1,
        attempts=1,
        segments=2,
    )
    assert {name: found[name].value for name in TRUE} == pytest.approx(TRUE, rel=1e-6)
    assert found["a.x(0)"].value == pytest.approx(1.0, abs=1e-6)


def test_slopes_are_those_of_runs_with_what_the_system_states(system):
    time = np.linspace(0, 4, 21)
    subject = subject_of(SystemFmu.coupled(system), ["a.k"], ["b.x"])
    start = {name: 0.0 for name in subject.states} | {"a.x": 1.0}
    response = subject.respond(Stretch(Window(0.0, time, {}), {"a.k": 4.0}, start))
    low, high = (run(system, time, **{"a.k": 4.0 + step})["b.x"] for step in (-1e-3, 1e-3))
    column = subject.recorded.index("b.x")
    assert response.slopes[:, column, 0] == pytest.approx((high - low) / 2e-3, abs=1e-6)
    assert subject.rates(Stretch(Window(0.0, time, {}), {}, start)) == {"a.x": "a.v", "b.x": "b.v"}


def test_a_system_that_is_stepped_is_refused(system):
    with pytest.raises(StickslipError, match="'masses' are stepped one by one"):
        calibrate(system.changed(solver="co-simulation"), {"time": [0.0], "a.x": [1.0]}, free=["a.k"])


def test_a_parameter_of_no_unit_is_refused(system):
    time = np.linspace(0, 10, 201)
    with pytest.raises(StickslipError, match=r"'masses' has no parameter 'a\.kk'"):
        calibrate(system, {"time": time, "a.x": np.cos(time)}, free=["a.kk"])
