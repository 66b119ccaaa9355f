"""simulate --max-step and --second-run on somebody else's FMU with a narrow pulse."""

from __future__ import annotations

from pathlib import Path

import pytest
from models import foreign


@pytest.fixture(scope="module")
def pulse(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return foreign("pulse", tmp_path_factory.mktemp("pulse"))


def test_a_pulse_that_one_run_missed_is_told_and_exits_with_1(stickslip, pulse: Path) -> None:
    answer = stickslip("simulate", pulse, "--until", 10, "--second-run")
    assert answer.code == 1
    said = " ".join(answer.out.split())
    assert "state event 0 at t = 7.2995 s, in the second run alone" in said
    assert "x differs from t = 7.3 s on: at most 1" in said


def test_runs_that_agree_exit_with_0(stickslip, pulse: Path) -> None:
    answer = stickslip("simulate", pulse, "--until", 10, "--second-run", "--max-step", 0.004, "--json")
    assert answer.code == 0
    assert answer.json["second_run"]["agrees"] is True
    assert answer.json["events"] == {"state 0": 2}
    assert "steps of at most 0.004 s (as asked for)" in answer.json["method"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--max-step", "-1"), "longest step must be a positive number"),
        (("--second-run", "--error"), "choose one"),
        (("--second-run", "--method", "co-simulation"), "this run has none"),
    ],
)
def test_what_does_not_go_together_is_refused(stickslip, pulse: Path, options: tuple[str, ...], message: str) -> None:
    answer = stickslip("simulate", pulse, *options)
    assert answer.code == 2
    assert message in " ".join(answer.err.split())
