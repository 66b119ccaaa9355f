"""Counts that the encoder of the body loses are told by the laser and taken off."""

from __future__ import annotations

import re

import numpy as np
import pytest
from foreign_bench import Faults, foreign_logs
from hypothesis import given
from hypothesis import strategies as st
from oracle.bench import Bench

from identification.measurement.lost_counts import lost_counts
from identification.measurement.pooling import pool

PITCH = 2 * np.pi / 1000


@given(
    st.lists(st.tuples(st.integers(1, 999), st.integers(-3, 3)), max_size=6),
    st.floats(-0.01, 0.01),
    st.integers(0, 2**31),
)
def test_jumps_of_whole_counts_are_found_beside_gain_and_line_errors(
    jumps: list[tuple[int, int]], gain: float, seed: int
) -> None:
    angle = 0.2 * np.sin(np.linspace(0, 30, 1000))
    lines = 0.02 * PITCH * np.random.default_rng(seed).uniform(-1, 1, 1000)
    wrong = np.zeros(1000)
    for at, count in jumps:
        wrong[at:] += count
    np.testing.assert_array_equal(lost_counts(gain * angle + lines + PITCH * wrong, PITCH), wrong)


def test_a_pitch_that_is_wrong_is_no_loss() -> None:
    assert not lost_counts(np.arange(100) * 0.75 * PITCH, PITCH).any()


@pytest.mark.nightly
def test_a_log_that_lost_counts_is_as_one_that_did_not() -> None:
    bench = Bench(lambda speed: 0.3 / (1 + 15 * speed) + 0.35)
    whole = pool(foreign_logs(bench, 3, (0.41, 0.83)))
    torn = pool(foreign_logs(bench, 3, (0.41, 0.83), faults=Faults(lost=(2.345, 2.3461, 6.12, 7.77))))
    said = [warning for warning in torn.sensors.warnings if "counted wrong" in warning]
    assert [sum(map(int, re.findall(r"([-+]\d+) at", one))) for one in said] == [-4, -4]
    assert not any("two clocks" in warning for warning in torn.sensors.warnings)
    assert torn.sensors.gain == pytest.approx(whole.sensors.gain, abs=3e-4)
    assert torn.sensors.delay == pytest.approx(whole.sensors.delay, abs=2e-5)
    assert torn.sensors.rms == pytest.approx(whole.sensors.rms, rel=0.05)
    assert not any("counted wrong" in warning for warning in whole.sensors.warnings)
