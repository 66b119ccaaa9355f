"""What a comparison of methods says of events, references and ranks."""

import dataclasses
import json
import math
import time
from collections.abc import Callable
from typing import Literal

import numpy as np
import pytest
from rich.console import Console

from fmu_models.base.errors import StickslipError
from fmu_models.validation.bench import run as bench_run
from fmu_models.validation.bench.output import as_json, print_table, write_page
from fmu_models.validation.bench.problems import problem
from fmu_models.validation.bench.reference import ReferenceSolution, Witness, reference
from fmu_models.validation.bench.run import compare, event_errors
from fmu_models.validation.methods.catalogue import OURS, chosen
from fmu_models.validation.methods.result import MethodRun, NotTreated, SwitchEvent
from fmu_models.validation.methods.scipy_events import ScipyEvents


def switch(time, before=2, after=3, contact="stop"):
    return SwitchEvent(time, contact, before, after)


def test_events_are_paired_missed_and_extra():
    known = [switch(1.0), switch(2.0, 3, 4), switch(3.0), switch(4.0, 3, 4), switch(4.5, 4, 2)]
    found = [switch(1.01), switch(2.0, 3, 2), switch(6.0)]
    errors = event_errors(found, known, 10.0)
    assert (errors.expected, errors.missed, errors.extra) == (4, 2, 1)
    assert errors.time == pytest.approx(0.01)


def test_no_events_at_all():
    assert event_errors([], [], 1.0).time is None


def made(*ends, exact=False):
    witnesses = tuple(Witness(f"code{i}", f"run {i}", np.array([end]), exact) for i, end in enumerate(ends))
    return ReferenceSolution(witnesses[0].end, (), witnesses, np.array([2.0]))


def test_reference_knows_its_own_error():
    known = made(1.0, 1.0 + 2e-9, 1.0 + 2e-12)
    assert known.own_error() == pytest.approx(1e-12, rel=1e-3)
    assert known.error(np.array([1.5])) == 0.25
    assert math.isinf(made(1.0).own_error())
    assert made(1.0, 1.1, exact=True).own_error() < 1e-15
    assert known.error(np.array([math.nan])) == math.inf


def test_a_method_is_no_witness_for_itself():
    known = ReferenceSolution(
        np.array([1.0]), (), (Witness("LinearFlow", "", np.array([1.0])), Witness("EventTaylor", "", np.array([1.0]))),
        np.array([1.0]),
    )  # fmt: skip
    assert known.own_error() == 0.0
    assert math.isinf(known.own_error(OURS))


@pytest.mark.nightly
def test_runs_that_part_are_no_reference(monkeypatch):
    """Two codes that end in different motions: nothing tells which of them is right."""
    monkeypatch.setattr("fmu_models.validation.bench.reference.APART", 1e-20)
    with pytest.raises(StickslipError, match="chaotic or grazes"):
        reference(problem("disc_rig_class_a", 1.0))


@pytest.fixture(scope="module")
def short():
    return problem("discontinuous_support_table_1", 6.283185307179586)


def test_rows_have_errors_costs_and_ranks(short):
    result = compare(short, (OURS, ScipyEvents(tolerances=(1e-8,))))
    ours, scipy = result.rows
    assert result.reference.startswith("closed form")
    assert result.expected == 2
    assert ours.error < 1e-14
    assert scipy.ranked
    assert 1e-10 < scipy.error < 1e-6
    assert scipy.events is not None
    assert scipy.events.missed == 0
    assert scipy.runs > 2
    assert scipy.ratio is not None
    assert scipy.ratio > 10
    assert scipy.memory is not None
    assert scipy.memory > 1000


class Slow:
    """Never finishes."""

    name = "slow"
    family: Literal["smoothing"] = "smoothing"
    tolerances = (1e-3, 1e-6)

    def prepare(self, problem) -> Callable[[float], MethodRun]:
        def run(tolerance: float) -> MethodRun:
            time.sleep(60)
            raise AssertionError

        return run


class Interrupted(Slow):
    """Someone presses Ctrl-C while it runs."""

    name = "interrupted"

    def prepare(self, problem) -> Callable[[float], MethodRun]:
        def run(tolerance: float) -> MethodRun:
            raise KeyboardInterrupt

        return run


class Broken(Slow):
    """Ends nowhere."""

    name = "broken"

    def prepare(self, problem) -> Callable[[float], MethodRun]:
        return lambda tolerance: MethodRun(np.array([math.nan, 0.0]), None, None, 1e-3)


class Dear(Slow):
    """Takes hours, as it says."""

    name = "dear"

    def prepare(self, problem) -> Callable[[float], MethodRun]:
        return lambda tolerance: MethodRun(np.array([0.0, 0.0]), None, None, 1e4)


def test_a_dear_method_leaves_others_their_rounds(short):
    dear, dear_too, ours = compare(short, (Dear(), OURS)).rows
    assert (dear.runs, dear_too.runs, ours.runs) == (1, 1, bench_run.ROUNDS)


def test_what_was_not_run_in_time_is_told_row_by_row(short, monkeypatch):
    monkeypatch.setattr(bench_run, "FIRST_UNTIL", -1.0)
    result = compare(short, (Dear(), Broken()))
    assert not result.rows
    assert [(row.method, row.why) for row in result.refusals] == [
        (f"{name}, {tolerance}", "not run: the time was used up")
        for tolerance in ("0.001", "1e-06")
        for name in ("dear", "broken")
    ]


def test_a_method_that_hangs_is_given_up(short, monkeypatch):
    monkeypatch.setattr(bench_run, "LONGEST", 0.2)
    result = compare(short, (OURS, Slow()))
    assert [row.method for row in result.rows] == [OURS.name]
    assert "given up after 0.2 s" in result.refusals[0].why


@pytest.mark.nightly
def test_an_interrupt_keeps_what_is_finished(short, tmp_path):
    result = compare(short, (OURS, Interrupted()))
    assert result.interrupted
    assert [row.method for row in result.rows] == [OURS.name]
    write_page([result], tmp_path / "page.html", overwrite=False)
    assert "Interrupted" in (tmp_path / "page.html").read_text("utf-8")


def test_an_end_that_is_no_number_does_not_rank(short):
    result = compare(short, (OURS, Broken()))
    assert not result.rows[1].ranked
    assert json.loads(json.dumps(as_json([result]), allow_nan=False))["scenes"][0]["rows"][1]["error"] is None


@pytest.mark.nightly
def test_page_needs_nothing_but_itself(short, tmp_path):
    write_page([compare(short, (OURS, ScipyEvents(tolerances=(1e-6,))))], tmp_path / "page.html", overwrite=False)
    page = (tmp_path / "page.html").read_text("utf-8")
    assert "<svg" in page
    for outside in ("src=", 'href="http', "@import", "<script", "<link"):
        assert outside not in page
    assert "closed form" in page


def test_brackets_in_a_reason_are_printed(short, capsys):
    made = dataclasses.replace(
        compare(short, (OURS,)), refusals=(bench_run.Refusal("peer", "install 'stickslip[bench]'"),)
    )
    print_table([made], Console(width=120))
    assert "peer: install 'stickslip[bench]'" in capsys.readouterr().out


def test_a_long_run_is_shortened_and_says_so(monkeypatch, tmp_path):
    monkeypatch.setattr(bench_run, "EVENTS", 3)
    made = compare(problem("discontinuous_support_table_1", 30.0), (OURS,))
    assert made.asked_time == 30.0 > made.stop_time > 3.0
    write_page([made], tmp_path / "page.html", overwrite=False)
    assert f"the first {made.stop_time:g} s of 30 s" in (tmp_path / "page.html").read_text("utf-8")


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (("discontinuous_suport",), "Did you mean 'discontinuous_support'"),
        (("block_on_belt", -1.0), "must end after it starts"),
        (("block_on_belt", math.inf), "finite"),
        (("missing.toml",), "no scene"),
    ],
)
def test_bad_input_is_said(given, says):
    with pytest.raises(StickslipError, match=says):
        problem(*given)


def test_unknown_method_names_the_nearest():
    with pytest.raises(StickslipError, match="No method has 'moreaux'"):
        chosen(["moreaux"])
    assert [method.name for method in chosen(["moreau"])] == ["Moreau time-stepping, theta 0.5"]


def test_varying_drive_is_left_to_the_engine():

    rig = dataclasses.replace(problem("disc_rig_class_a", 1.0), steady=False)
    with pytest.raises(NotTreated, match="varies with time"):
        ScipyEvents().prepare(rig)


def test_an_error_like_that_of_the_reference_does_not_rank():
    """Without a closed form: the engine is better than the codes that could judge it, and is not ranked above them."""
    result = compare(problem("disc_rig_class_a", 2.0), (OURS, ScipyEvents(tolerances=(1e-6,))))
    ours, coarse = result.rows
    assert "agrees with" in result.reference
    assert not ours.ranked
    assert ours.error < 1e-10
    assert coarse.ranked
