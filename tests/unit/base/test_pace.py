"""The time that work still needs: right for steady work, silent rather than tenfold wrong where the speed changes."""

from __future__ import annotations

import itertools
import random

import pytest

from fmu_models.base import console
from fmu_models.base.pace import Pace, spoken


def told(course):
    """What is said of (time, share done), with the truth."""
    course = list(course)
    pace, end = Pace(), course[-1][0]
    said = ((time, pace.remaining(time, done)) for time, done in course)
    return [(left, end - time) for time, left in said if left is not None]


def test_steady_work_is_told_exactly():
    said = told((0.5 * i, i / 200) for i in range(201))
    assert len(said) > 150
    assert all(left == pytest.approx(truth, rel=1e-6, abs=1e-6) for left, truth in said)


def test_a_share_that_falls_back_says_nothing():
    course = [(0.1 * i, (i % 50) / 100) for i in range(1, 150)]
    pace = Pace()
    left = [pace.remaining(time, done) for time, done in course]
    assert all(one is None or one >= 0 for one in left)


def test_a_bootstrap_after_a_quick_fit_neither_jumps_nor_is_far_off():
    # draws of 0.9 s each, finished in pairs by two processes, after a fit of 2 s
    rng = random.Random(1)
    begin = [(0.1 * i, 0.01 + 0.0005 * i) for i in range(1, 21)]
    ends = itertools.accumulate((rng.expovariate(1 / 1.8) if i % 2 else 0.01 for i in range(200)), initial=2.0)
    said = told([*begin, *((time, 0.02 + 0.97 * i / 200) for i, time in enumerate(ends) if i)])
    assert len(said) > 100
    for (left, _), (later, _) in itertools.pairwise(said):
        assert later < 1.5 * left + 5 and left < 1.5 * later + 5
    for left, truth in said:
        assert 0.4 * truth - 5 < left < 2.5 * truth + 5


def test_work_that_stands_still_is_not_guessed():
    pace = Pace()
    assert pace.remaining(20.0, 0.0) is None
    assert [pace.remaining(30.0 + i, 0.5) for i in range(60)][-1] is None


def test_durations():
    assert [spoken(one) for one in (0.2, 59.0, 61.0, 3725.0)] == ["1 s", "59 s", "1 min 01 s", "1 h 02 min"]


def test_a_pipe_gets_a_line_every_ten_seconds(monkeypatch, capsys):
    clock = iter([0.0, *(0.5 * i for i in range(1, 101))])
    monkeypatch.setattr(console.time, "monotonic", lambda: next(clock))
    with console.progress("fitting") as advance:
        for i in range(1, 101):
            advance(i / 200)
    said = capsys.readouterr()
    assert said.out == ""
    lines = said.err.splitlines()
    assert lines[0] == "stickslip: fitting: 10%, about 1 min 30 s left"
    assert len(lines) == 5


def test_short_work_says_nothing_in_a_pipe(capsys):
    with console.progress("fitting") as advance:
        advance(0.5)
    assert capsys.readouterr().err == ""
