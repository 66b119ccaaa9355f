"""Designed motion of a machine: within its limits, better than chance, with deviations that come true."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas
import pytest
from checkout import ROOT
from emulated_arm import ARM, torques
from typer.testing import CliRunner
from whole_application import app

from fmu_models import Mechanism, StickslipError
from fmu_models.oscillators import load
from identification.machines.excite import Excitation, excite
from identification.machines.regressor import base_parameters, regressor_of

MODEL = ROOT / "data" / "machines" / "two_link_arm.py"
KNOWN = {"g": ARM["g"], "l1": ARM["l1"]}
LIMITS = {"q1": (-1.0, 2.0), "q2": (-2.0, 2.0), "w1": (-4.0, 4.0), "w2": (-5.0, 6.0), "tau1": (-7.0, 7.0)}


@pytest.fixture(scope="module")
def arm() -> Mechanism:
    return load(MODEL)


@pytest.fixture(scope="module")
def found(arm: Mechanism) -> Excitation:
    return excite(arm, LIMITS, known=KNOWN, period=6.0, harmonics=3)


@pytest.mark.nightly
def test_the_motion_stays_within_limits_and_is_its_own_derivative(found: Excitation):
    time = np.linspace(0.0, 6.0, 4001)
    q, v, a = found.at(time)
    tau = torques(q, v, a)
    shown = {"q1": q[:, 0], "q2": q[:, 1], "w1": v[:, 0], "w2": v[:, 1], "tau1": tau[:, 0]}
    for name, (low, high) in LIMITS.items():
        assert shown[name].min() > low - 1e-3 * (high - low) and shown[name].max() < high + 1e-3 * (high - low)
    for value, rate in ((q, v), (v, a)):
        assert np.gradient(value, time, axis=0)[1:-1] == pytest.approx(rate[1:-1], abs=1e-3 * np.abs(a).max())


def test_it_shows_more_than_the_best_of_random_motions(found: Excitation):
    assert found.gain > 0.5
    assert found.condition < 20


def test_the_deviations_come_true(arm: Mechanism, found: Excitation):
    """Least squares on efforts with the noise that was foretold, 300 times."""
    regressor = regressor_of(arm, KNOWN)
    base = base_parameters(regressor)
    frame = found.frame
    motion = [
        frame[[f"{joint}{part}" for joint in found.joints]].to_numpy() for part in ("", "_velocity", "_acceleration")
    ]
    columns = regressor(*motion)[:, :, base.places].reshape(-1, len(base.names))
    usual = np.sqrt(np.mean(torques(*motion) ** 2))
    noise = found.noise * usual * np.random.default_rng(1).normal(size=(len(columns), 300))
    spread = np.std(np.linalg.lstsq(columns, noise, rcond=None)[0], axis=1)
    for name, deviation in zip(base.names, spread, strict=True):
        assert found.deviations[name] == pytest.approx(deviation, rel=0.2)


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ({"q1": (-1, 1)}, "Give limits of q2"),
        ({"q1": (-1, 1), "q2": (-1, 1), "q3": (-1, 1)}, "no coordinate, velocity or effort 'q3'"),
        ({"q1": (1, -1), "q2": (-1, 1)}, "leave nothing"),
        ({"q1": (-1, 1), "q2": (-1, 1), "w1": (1, 2)}, "must hold 0"),
        ({"q1": (1.4, 1.6), "q2": (-0.1, 0.1), "tau1": (-0.1, 0.1)}, "efforts beyond their limits"),
    ],
)
def test_limits_that_allow_nothing_are_refused(arm: Mechanism, limits: dict[str, tuple[float, float]], said: str):
    with pytest.raises(StickslipError, match=said):
        excite(arm, limits, known=KNOWN)


@pytest.mark.nightly
def test_the_command_writes_the_motion(tmp_path: Path):
    limits = [f"--limit={name}={low}:{high}" for name, (low, high) in list(LIMITS.items())[:2]]
    asked = [
        "excite",
        str(MODEL),
        *limits,
        "--period",
        "4",
        "--harmonics",
        "1",
        "-o",
        str(tmp_path / "m.csv"),
        "--json",
    ]
    done = CliRunner().invoke(app, asked)
    assert done.exit_code == 0, done.output
    said = json.loads(done.stdout)
    frame = pandas.read_csv(tmp_path / "m.csv")
    assert len(frame) == 1000 and said["joints"] == ["q1", "q2"]
    # on a terminal every parameter, however many there are
    shown = CliRunner().invoke(app, ["excite", str(MODEL), *limits, "--period", "4", "--harmonics", "1"]).stdout
    deviations = json.loads(done.stdout)["deviations"]
    lines = [line.strip() for line in shown.splitlines()]
    assert len(deviations) > 8 and all(any(line.startswith(name) for line in lines) for name in deviations)
    wrong = CliRunner().invoke(app, ["excite", str(MODEL), "--limit", "q1=1"])
    assert isinstance(wrong.exception, StickslipError) and "NAME=LOW:HIGH" in str(wrong.exception)
