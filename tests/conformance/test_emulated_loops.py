"""Fits of emulated loops and decays: the truth is held where the law is right, and a fault that no law knows is told.

All faults, and how often intervals hold: tests/benchmarks/bench_loops.py.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from loop_benches import LAWS, NOISY, holding, loop_log

from identification import fit_decays, identify_hysteresis
from rig_io.bench.joint import JointBench, record_loop
from rig_io.bench.settings import write_recorded
from rig_io.bench.swing import SwingBench, record_decay

SEEN = replace(JointBench(), **{**NOISY, "noise_way": 2e-4})


def notes_of(**fault: Any) -> str:
    return "\n".join(identify_hysteresis(loop_log(record_loop(replace(SEEN, **fault))), laws=[]).notes)


@pytest.mark.nightly_for("Dahl", "MaxwellSlip-4", "BoucWen-1", "Iwan4")
@pytest.mark.parametrize("name", LAWS)
def test_a_law_with_noise_of_the_way_is_found(name: str) -> None:
    law, truth = LAWS[name]
    fit = identify_hysteresis(loop_log(record_loop(JointBench(law=law, **NOISY), seed=1)), laws=[name])
    z, _ = holding(fit, name, truth)
    assert np.abs(z).max() < 4
    assert not any("Sliders leave" in note for note in fit.notes)


def test_a_bench_without_a_fault_is_said_nothing_of() -> None:
    assert notes_of() == ""


@pytest.mark.parametrize(
    ("fault", "sentence"),
    [
        ({"lag": 0.01}, "samples after its way"),
        ({"wear": 0.05}, "changes by -5"),
        ({"one_sided": 0.1}, r"is \+9.* larger on the positive side"),
        ({"cubic": 70 / 5e-3**3}, "spring beside that stiffens"),
        ({"load_steps": 0.2}, "of its cycles differs by"),
        ({"saturated": 60.0}, "rise at once"),
        ({"drift": 35.0}, "do not close"),
        ({"sampling_rate": 20.0}, "samples a cycle, which miss peaks"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_a_fault_is_told(tmp_path: Path, fault: dict[str, float], sentence: str) -> None:
    if "sampling_rate" in fault:  # said where files are read
        made = write_recorded(tmp_path / "d", [record_loop(replace(SEEN, **fault))], title="")  # type: ignore[arg-type]
        said = "\n".join(identify_hysteresis(str(made / "loop.csv"), laws=[]).notes)
    else:
        said = notes_of(**fault)
    assert re.search(sentence, said), said


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("bench", "sentence"),
    [
        (SwingBench(noise=1e-3, runs=2.0, driven=7.0), ""),
        (SwingBench(noise=1e-3, zero=0.05, jitter=0.5, lost=0.2), ""),
        (SwingBench(noise=1e-3, kind="gravity"), "say --pendulum"),
        (SwingBench(noise=1e-3, cubic=2.5), "stiffens with the angle"),
    ],
    ids=["driven", "uneven", "gravity", "cubic"],
)
def test_a_decay_holds_the_truth_or_says_why_not(tmp_path: Path, bench: SwingBench, sentence: str) -> None:
    made = write_recorded(tmp_path / "d", [record_decay(bench, seed=3)], title="")
    fit = fit_decays(made / "decay.csv")
    if sentence:
        assert any(sentence in warning for warning in fit.warnings)
        return
    assert not any("its noise" in warning for warning in fit.warnings)
    for name in ("w0", "f", "c", "b"):
        deviation = fit[name].standard_deviation
        assert deviation is not None
        assert abs(fit[name].value - getattr(bench, name)) < 4 * deviation, name
