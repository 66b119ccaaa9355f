"""The command that follows a branch: its curves, and what an interrupt leaves."""

from __future__ import annotations

import json
import signal
from contextlib import contextmanager

import pytest

from fmu_models.base import console

SUPPORT = ("branch", "discontinuous_support", "--forcing", "omega", "--set", "omega=0.8", "--over", "omega=0.8:1.4")


def test_curves_are_written_and_drawn(stickslip, tmp_path):
    answer = stickslip(*SUPPORT, "--curve", "g=3:5", "--figure", "curves.svg", "--json")
    assert answer.code == 0
    curves = json.loads(answer.out)["curves"]
    assert [one["kind"] for one in curves].count("grazing, compliant") == 2
    assert all(len(one["points"]) > 5 for one in curves)
    assert "grazing, compliant" in (tmp_path / "curves.svg").read_text("utf-8")


def test_a_closed_form_is_laid_over_curves(stickslip, tmp_path):
    form = "f0/sqrt((k - m*omega**2)**2 + (c*omega)**2)"
    asked = (*SUPPORT, "--curve", "g=3:5", "--closed-form", form)
    answer = stickslip(*asked, "--figure", "curves.svg", "--json")
    curves = json.loads(answer.out)["curves"]
    away = {one["kind"]: one["from_closed_form"] for one in curves}
    assert away["grazing, compliant"] < 1e-11 < 1e-6 < away["fold"]
    assert all(len(one["states"]["x"]) == len(one["multipliers"]) == len(one["points"]) for one in curves)
    assert "g: closed form" in (tmp_path / "curves.svg").read_text("utf-8")
    for formula, said in (("q*omega", "has no parameter 'q'"), ("g/2", "and not by itself"), ("1 +", "is no formula")):
        answer = stickslip(*asked[:-1], formula)
        assert answer.code != 0 and said in answer.err
    answer = stickslip(*SUPPORT, "--closed-form", form)
    assert answer.code != 0 and "--curve NAME=FROM:TO" in answer.err


def test_a_curve_over_nothing_is_told(stickslip, tmp_path):
    answer = stickslip(*SUPPORT, "--curve", "gap=3:5", "--figure", "curves.svg")
    assert answer.code != 0 and "has no parameter 'gap'" in answer.err
    assert not (tmp_path / "curves.svg").exists()


def test_a_diagram_with_branches_from_the_shell(stickslip, tmp_path):
    asked = ("diagram", "logistic", "--over", "r=2.9:3.1:5", "--branches", "2", "--figure", "d.svg", "--json")
    answer = stickslip(*asked)
    assert answer.code == 0
    assert [one["every"] for one in json.loads(answer.out)["branches"]] == [1, 2]
    assert "unstable" in (tmp_path / "d.svg").read_text("utf-8")


def test_an_interrupt_keeps_the_points_so_far(stickslip, monkeypatch):
    """A real signal, raised as the 20th motion is told of; no other branch is begun after it."""

    @contextmanager
    def progress(doing):
        told = []

        def advance(fraction):
            told.append(fraction)
            if len(told) == 20:
                signal.raise_signal(signal.SIGINT)

        yield advance

    monkeypatch.setattr(console, "progress", progress)
    answer = stickslip(*SUPPORT, "--set", "ks=300", "--switch", "all", "--json")
    assert answer.code == 130
    (kept,) = json.loads(answer.out)["branches"]
    assert kept["points"] == 20
    assert {one["kind"] for one in kept["ends"]} == {"interrupted"}
    assert [one["value"] for one in kept["special"]][:1] == pytest.approx([0.9403078158347812], abs=1e-10)
