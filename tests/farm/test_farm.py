"""The farm itself: right FMUs pass, a wrong level, a crash and a hang are told, and what is shipped passes."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hostile_models import hostile
from models import foreign

from fmu_models import oscillators
from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import FMI_VERSIONS, built
from tests.farm.__main__ import FAILURES, farm, main, named
from tests.farm.packages import PACKAGES
from tests.farm.verdict import CRASHED, PASS, REFUSED, TIMED_OUT, WRONG, Verdict

SHARED = Path(__file__).parents[3] / "shared" / "data" / "reference_fmus"
# friction, a stop, impacts; the others at night
G, E = 9.81, 0.7
BOUNCE = np.sqrt(2 / G)  # s, from 1 m
DAILY = ("disc_rig", "discontinuous_support", "bouncing_ball")


def verdict(path: Path, **options: float) -> Verdict:
    return next(iter(farm([path], **options)))  # pyright: ignore[reportArgumentType]


def speed(times: np.ndarray, bounce: float = BOUNCE) -> np.ndarray:
    """(n,) of the ball that falls from 1 m, in its first flights, if it bounced then."""
    return np.where(times < bounce, -G * times, E * G * BOUNCE - G * (times - BOUNCE))


def reference(path: Path, times: np.ndarray, values: np.ndarray, name: str = "x") -> None:
    pd.DataFrame({"time": times, name: values}).to_csv(path.with_name(f"{path.stem}_ref.csv"), index=False)


@pytest.mark.parametrize("fmi", [1, 2, 3])
def test_a_right_fmu_passes_and_a_wrong_level_of_its_reference_does_not(fmi: int, tmp_path: Path) -> None:
    path = foreign("ball", tmp_path, fmi)
    times = np.union1d(np.arange(51) / 50, [BOUNCE])
    for shift in (1e-9, -1e-9):
        reference(path, times, speed(times, BOUNCE + shift), "v")
        assert (verdict(path).word, verdict(path).reason) == (PASS, "")
    reference(path, times, speed(times) + 0.01 * (times == times[41]), "v")
    wrong = verdict(path)
    assert wrong.word == WRONG
    assert f"'v' at t = {times[41]:.9g} s" in wrong.reason and "ours for the reference" in wrong.reason


def test_a_reference_of_events_that_are_late_is_wrong(tmp_path: Path) -> None:
    path = foreign("ball", tmp_path)
    times = np.arange(51) / 50
    reference(path, times, times > BOUNCE + 0.05, "bounces")
    assert "'bounces' at t = 0.46 s" in verdict(path).reason


def test_inputs_and_times_stand_beside_an_fmu(tmp_path: Path) -> None:
    path = foreign("driven", tmp_path)  # x' = u + step
    frame = pd.DataFrame({"time": [0.0, 1.0, 1.0, 3.0], "u": [0.0, 2.0, -1.0, -1.0]})
    frame.to_csv(tmp_path / "driven2_in.csv", index=False)
    (tmp_path / "driven2_ref.opt").write_text("StartTime,0.0\nStopTime,3.0\nStepSize,0.01\nRelTol,1e-4\n")
    reference(path, np.array([0.0, 0.5, 1.0, 2.0, 3.0]), np.array([0.0, 0.25, 1.0, 0.0, -1.0]))
    right = verdict(path)
    assert (right.word, right.reason) == (PASS, "")
    assert {c.judge for c in right.comparisons} == {"fmpy", "reference"}
    reference(path, np.array([0.0, 0.5, 1.0, 2.0, 3.0]), np.array([0.0, 0.25, 1.0, 0.0, -1.001]))
    assert verdict(path).word == WRONG


def test_what_crashes_hangs_or_is_no_fmu_stops_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "fmus"
    folder.mkdir()
    for name in ("crash", "hang"):
        shutil.copy(hostile(name, tmp_path), folder)
    (folder / "none.fmu").write_text("no archive")
    shutil.copy(foreign("dahlquist", tmp_path), folder)
    code = main([str(folder), "--limit", "5", "--output", str(tmp_path / "out")])
    table = pd.read_csv(tmp_path / "out" / "farm.csv", keep_default_na=False)
    words = {Path(path).stem: word for path, word in zip(table.fmu, table.verdict, strict=True)}
    assert words == {"crash": CRASHED, "hang": TIMED_OUT, "none": REFUSED, "dahlquist2": PASS}
    assert "stickslip: " in table.reason[table.fmu.str.endswith("none.fmu")].item()
    assert code == 1 and "1 pass, 1 refused, 1 timed out, 0 wrong, 1 crashed" in capsys.readouterr().out
    assert "dahlquist2.fmu" in (tmp_path / "out" / "farm.md").read_text()
    assert set(pd.read_csv(tmp_path / "out" / "farm_variables.csv").judge) == {"fmpy"}


def test_a_name_of_nothing_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["disc_rigg", "--output", str(tmp_path)]) == 2
    assert "Did you mean 'disc_rig'?" in capsys.readouterr().err
    assert main([str(tmp_path), "--output", str(tmp_path)]) == 2


CASES = [
    pytest.param(model, version, marks=[] if model in DAILY else pytest.mark.nightly)
    for model in oscillators.names()
    for version in FMI_VERSIONS
]


@pytest.mark.parametrize(("model", "version"), CASES)
def test_exports_run_as_by_other_tools(model: str, version: str) -> None:
    ours = verdict(built(model, fmi_version=version), seconds=300.0, until=5.0)
    assert (ours.word, ours.reason) == (PASS, "")
    judges = {(c.interface, c.judge) for c in ours.comparisons}
    exchange, steps = "ModelExchange", "CoSimulation"
    assert judges == {(exchange, "fmpy"), (steps, "fmpy"), (exchange, "engine"), (exchange, steps)}


@pytest.mark.nightly
def test_reference_fmus_are_run_right() -> None:
    if not SHARED.is_dir():
        pytest.skip("the reference FMUs are not beside the project")
    words = {f"{v.path.parent.name}/{v.path.stem}": v.word for v in farm(sorted(SHARED.rglob("*.fmu")), seconds=30.0)}
    # the one is scheduled alone; the other asks for 1e11 steps of its own
    exceptions = {"3/Clocks": REFUSED, "3/Roberts": TIMED_OUT}
    assert words == {name: PASS for name in words} | exceptions


@pytest.mark.nightly
@pytest.mark.parametrize("package", [package.name for package in PACKAGES])
def test_fmus_of_other_makers_are_run_right(package: str) -> None:
    try:
        paths = named(package)
    except StickslipError as error:
        pytest.skip(str(error))
    verdicts = list(farm(paths))
    assert verdicts and not [f"{v.path}: {v.reason}" for v in verdicts if v.word in FAILURES]
