"""Friction from free decays, against motions by other means: closed forms of half cycles, and DOP853."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from typer.testing import CliRunner
from whole_application import app

from fmu_models.base.errors import StickslipError
from identification import fit_decays

W0, F, C, B, ZERO = 5.0, 0.12, 0.06, 0.04, 0.013


def swinging(begin: float, *, pendulum: bool, end: float, step: float = 0.01) -> tuple[np.ndarray, np.ndarray]:
    """Time and angle of a decay from rest at an angle, half cycle by half cycle."""
    times, q = np.arange(0.0, end, step), float(begin)
    angles, t = np.empty(len(times)), 0.0
    back = (lambda x: W0**2 * np.sin(x)) if pendulum else (lambda x: W0**2 * x)
    angles[0] = q
    while t < times[-1]:
        sense = -np.sign(q)
        if abs(back(q)) <= F:
            angles[times >= t] = q
            break

        def moved(_: float, y: np.ndarray, sense: float = sense) -> list[float]:
            return [y[1], -back(y[0]) - sense * (F + C * abs(y[1]) + B * y[1] ** 2)]

        def turns(_: float, y: np.ndarray, sense: float = sense) -> float:
            return sense * y[1]

        turns.terminal, turns.direction = True, -1  # type: ignore[attr-defined]
        run: Any = solve_ivp(moved, (t, end), [q, sense * 1e-12], "DOP853", events=turns, rtol=1e-11, atol=1e-13,
                        dense_output=True)  # fmt: skip
        inside = (times >= t) & (times <= run.t[-1])
        angles[inside] = run.sol(times[inside])[0]
        t, q = run.t[-1], run.y[0, -1]
    return times, angles


def written(path: Path, time: np.ndarray, angle: np.ndarray, heads: str = "time,angle") -> Path:
    np.savetxt(path, np.column_stack([time, angle]), delimiter=",", header=heads, comments="")
    return path


@pytest.mark.nightly_for("True")
@pytest.mark.parametrize("pendulum", [False, True])
def test_all_three_kinds_of_friction_are_told_apart(tmp_path, pendulum: bool) -> None:
    """With noise of 1e-4 rad: within four deviations, dry friction to 1 %."""
    time, angle = swinging(0.8, pendulum=pendulum, end=40.0)
    noise = 1e-4 * np.random.default_rng(1).normal(size=len(time))
    fit = fit_decays(written(tmp_path / "swing.csv", time, angle + ZERO + noise), pendulum=pendulum)
    for name, value in (("w0", W0), ("f", F), ("c", C), ("b", B), ("zero", ZERO)):
        deviation = fit[name].standard_deviation
        assert deviation is not None
        assert abs(fit[name].value - value) < 4 * deviation, name
    assert fit["f"].standard_deviation is not None
    assert fit["f"].standard_deviation < 0.01 * F


def test_a_driven_start_is_cut_and_two_decays_in_a_file_are_parted(tmp_path) -> None:
    time, angle = swinging(0.8, pendulum=False, end=25.0)
    rise = np.arange(0.0, 2 * np.pi / W0 * 4, 0.01)
    driven = 0.8 * rise / rise[-1] * np.cos(W0 * rise)
    whole = np.concatenate([driven, angle, 0.5 * np.linspace(angle[-1], 1.6, 60)[1:], angle])
    fit = fit_decays(written(tmp_path / "twice.csv", np.arange(len(whole)) * 0.01, whole))
    assert fit.logs == ("twice.csv, decay 1", "twice.csv, decay 2")
    assert fit["f"].value == pytest.approx(F, rel=0.02)
    assert fit["c"].value == pytest.approx(C, rel=0.1)
    assert time[-1] < 25.0


@pytest.mark.nightly
def test_the_command_reads_degrees_and_refuses_what_does_not_decay(tmp_path) -> None:
    time, angle = swinging(0.5, pendulum=True, end=30.0)
    path = written(tmp_path / "swing.csv", time, np.rad2deg(angle), "time [s],theta [deg]")
    done = CliRunner().invoke(app, ["decay", str(path), "--pendulum", "--json"])
    assert done.exit_code == 0, done.output
    values = {one["name"]: one["value"] for one in json.loads(done.stdout)["parameters"]}
    assert values["f"] == pytest.approx(F, rel=1e-3)
    assert values["w0"] == pytest.approx(W0, rel=1e-5)
    with pytest.raises(StickslipError, match="shows no decay of 4 half cycles"):
        fit_decays(written(tmp_path / "still.csv", time, np.sin(time)))


def test_a_time_is_read_in_the_unit_that_the_file_states_and_up_to_the_rest(tmp_path) -> None:
    time, angle = swinging(0.5, pendulum=False, end=40.0)
    fit = fit_decays(written(tmp_path / "swing.csv", 1e3 * time, angle, "time [ms],angle [rad]"))
    assert fit["w0"].value == pytest.approx(W0, rel=1e-5)
    # a log that goes on at rest is taken to two periods after its last swing
    rests = time[np.argmax(angle == angle[-1])]
    assert rests < 25
    assert rests < fit.log().time[-1] < rests + 2 * 2 * np.pi / W0
