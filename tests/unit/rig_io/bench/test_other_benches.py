"""Benches of joints and of decays against other computations, and what their settings take and refuse."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from emulated_loop import of_bouc_wen, of_dahl, of_sliders
from scipy.integrate import solve_ivp
from typer.testing import CliRunner
from whole_application import app

from fmu_models.base.errors import StickslipError
from identification.hysteresis.read import read_loop
from rig_io.bench.joint import JointBench, law_of, record_loop
from rig_io.bench.settings import benches, log_names
from rig_io.bench.swing import SwingBench, record_decay

SLIDERS = JointBench(sampling_rate=400.0, cycles=3.0)
K, D = [3e5, 1e5], [5e-4, 2e-3]


def test_sliders_are_moved_as_another_program_moves_them() -> None:
    seen = record_loop(SLIDERS).columns
    assert np.abs(seen["force"] - of_sliders(seen["way"], K, D)).max() < 1e-9
    # the last turn, a quarter of a cycle before the end
    assert np.abs(seen["way"]).max() == pytest.approx(5e-3 * (0.2 + 0.8 * 2.75 / 3), rel=2e-3)


@pytest.mark.nightly
def test_dahl_and_bouc_wen_are_moved_as_other_programs_move_them() -> None:
    seen = record_loop(replace(SLIDERS, law="Dahl(sigma=3e5, F_c=300)", programme="random"), seed=4).columns
    assert np.abs(seen["force"] - of_dahl(seen["way"], 3e5, 300.0)).max() < 1e-9
    seen = record_loop(replace(SLIDERS, law="BoucWen(k=3e5, beta=600, gamma=400, n=1)", programme="triangle")).columns
    assert np.abs(seen["force"] - of_bouc_wen(seen["way"], 3e5, 600.0, 400.0, 1)).max() < 1e-5  # RK4 across z = 0


def test_each_fault_does_what_it_says() -> None:
    clean = record_loop(SLIDERS).columns
    force, way, time = clean["force"], clean["way"], clean["time"]

    def seen(**fault: Any) -> dict[str, np.ndarray]:
        return dict(record_loop(replace(SLIDERS, **fault)).columns)

    assert seen(frame=1e6)["way"] == pytest.approx(way + force / 1e6, abs=1e-12)
    assert seen(lag=0.01)["force"][4:] == pytest.approx(force[:-4], abs=1e-9)
    assert seen(drift=30.0, offset=5.0)["force"] == pytest.approx(force + 5 + 30 * time / time[-1], abs=1e-9)
    assert seen(one_sided=0.1)["force"] == pytest.approx(force * np.where(force > 0, 1.1, 1.0), abs=1e-9)
    assert seen(wear=0.2)["force"][-1] == pytest.approx(0.8 * force[-1], abs=1e-9)
    gap = seen(backlash=1e-4)["way"] - way
    assert gap[np.abs(force) > 10] == pytest.approx(1e-4 * np.sign(force[np.abs(force) > 10]), abs=1e-12)
    warm = seen(warming=20.0, softening=-0.01)
    assert warm["force"] == pytest.approx(force * (1 - 0.01 * (warm["temperature"] - 20)), abs=1e-9)
    stepped = seen(load=50.0, load_steps=0.3)
    assert stepped["force"] == pytest.approx(force * stepped["load"] / 50, abs=1e-9)
    assert len(np.unique(stepped["load"])) == 4
    damped = seen(saturated=40.0, viscous=100.0, inertia=2.0)["force"] - force
    speed = np.gradient(way, time)
    expected = 40 * np.tanh(speed / 0.01) + 100 * speed + 2 * np.gradient(speed, time)
    assert damped[3:-3] == pytest.approx(expected[3:-3], abs=1e-9)
    written = seen(unit_way="in", unit_force="kN", sign=-1.0, clock="no", cut=0.5)
    assert written["way"] == pytest.approx(way[200:] / 0.0254, abs=1e-9)
    assert written["force"] == pytest.approx(-force[200:] / 1e3, abs=1e-9)
    assert "time" not in written
    assert np.std(seen(noise_way=1e-3)["way"] - way) == pytest.approx(1e-3 * np.ptp(way), rel=0.1)
    assert np.unique(seen(step_force=10.0)["force"] % 10.0).tolist() == [0.0]


@pytest.mark.nightly
def test_a_swing_is_that_of_another_integrator() -> None:
    """Two half cycles by DOP853, from where it is let go."""
    bench = SwingBench(kind="gravity", cubic=1.0, uneven=0.3, breakaway=0.4, duration=4.0, sampling_rate=200.0)
    seen = record_decay(bench).columns

    def moved(_: float, y: np.ndarray, sense: float) -> list[float]:
        dry = bench.f * (1 + 0.3 * np.sin(8 * y[0])) * (1 + 0.4 * np.exp(-abs(y[1]) / bench.speed))
        drag = dry + bench.c * abs(y[1]) + bench.b * y[1] ** 2
        return [y[1], -25 * np.sin(y[0]) - y[0] ** 3 - sense * drag]

    def turns(_: float, y: np.ndarray, sense: float) -> float:
        return sense * y[1]

    turns.terminal, turns.direction = True, -1  # type: ignore[attr-defined]
    t, q, sense = 0.0, 0.8, -1.0
    while t < 1.5:
        run: Any = solve_ivp(moved, (t, 9.0), [q, sense * 1e-12], "DOP853", events=turns, rtol=1e-11, atol=1e-13,
                        dense_output=True, args=(sense,))  # fmt: skip
        inside = (seen["time"] >= t) & (seen["time"] <= run.t[-1])
        assert np.abs(seen["angle"][inside] - run.sol(seen["time"][inside])[0]).max() < 1e-4  # of interpolation
        t, q, sense = run.t[-1], run.y[0, -1], -sense


@pytest.mark.nightly
def test_runs_of_a_decay_follow_one_another_from_where_they_rest() -> None:
    bench = SwingBench(runs=2.0, driven=4.0, duration=20.0, unit="deg", lost=0.2, jitter=0.5)
    seen = record_decay(bench, seed=2).columns
    steps = np.diff(seen["time"])
    assert steps.min() > 0
    assert np.std(steps) > 1e-3
    assert np.abs(np.diff(seen["angle"])).max() < np.rad2deg(0.8 * 5.0 * steps.max() * 1.2)
    assert seen["time"][-1] == pytest.approx(48.0, abs=0.1)


def test_a_log_for_each_combination_with_its_conditions_in_its_name() -> None:
    asked = benches(JointBench, ["amplitude=1mm,25mm", "rate=0.25Hz,2Hz", "unit_way=mm", "noise_way=0.1%"])
    assert log_names("loop", asked) == ["loop_1mm0x25Hz", "loop_1mm2Hz", "loop_25mm0x25Hz", "loop_25mm2Hz"]
    assert [bench.amplitude for bench, _ in asked] == [1e-3, 1e-3, 25e-3, 25e-3]
    assert asked[0][0].noise_way == pytest.approx(1e-3)
    assert log_names("loop", [*benches(JointBench, [])] * 2) == ["loop", "loop_1"]


@pytest.mark.parametrize(
    ("texts", "sentence"),
    [
        (["amplitud=1mm"], "Did you mean 'amplitude'"),
        (["amplitude=3N"], "Its unit is m"),
        (["amplitude=wide"], "no number"),
        (["rate=1", "rate=2"], "twice"),
        (["programme=square"], "one of sine, triangle, growing, random"),
        (["cycles=0.5"], "at least 1"),
        (["cut=9"], "has nothing of 8 s"),
    ],
)
def test_settings_that_are_none_are_refused_in_words(texts: list[str], sentence: str) -> None:
    with pytest.raises(StickslipError, match=sentence):
        benches(JointBench, texts)


@pytest.mark.parametrize("text", ["Dahll(sigma=1, F_c=2)", "Dahl(sigma=1)", "__import__('os')", "Dahl(", "Dahl(a, b)"])
def test_a_law_that_is_none_is_refused_in_words(text: str) -> None:
    with pytest.raises(StickslipError, match="is no law"):
        law_of(text)


def test_the_command_writes_logs_that_are_read_and_keeps_the_truth_beside(tmp_path: Path) -> None:
    folder = tmp_path / "joint"
    said = ["--set", "amplitude=1mm,5mm", "--set", "unit_way=mm", "--set", "unit_force=kN", "--seed", "3"]
    done = CliRunner().invoke(app, ["emulate", "loop", str(folder), *said, "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["logs"] == ["loop_1mm.csv", "loop_5mm.csv"]
    log = read_loop(folder / "loop_5mm.csv")
    bench = replace(JointBench(), unit_way="mm", unit_force="kN", amplitude=5e-3)
    assert log.force == pytest.approx(1e3 * record_loop(bench).columns["force"])
    assert log.conditions == {"mm": 5.0}
    beside = json.loads((folder / "datapackage.json").read_text("utf-8"))
    assert beside["resources"][1]["emulation"]["law"] == bench.law
    assert "MaxwellSlip" not in (folder / "loop_5mm.csv").read_text("utf-8")
    for asked, sentence in (
        (["loop"], "where the logs go"),
        (["loop", str(folder)], "exists already"),
        ([str(folder), "--set", "rate=1"], "of loops and decays"),
        (["decay", str(tmp_path / "d"), "--speeds", "1"], "--set"),
    ):
        refused = CliRunner().invoke(app, ["emulate", *asked])
        assert isinstance(refused.exception, StickslipError)
        assert sentence in str(refused.exception)
