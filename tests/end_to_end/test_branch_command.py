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


def test_a_curve_over_nothing_is_told(stickslip, tmp_path):
    answer = stickslip(*SUPPORT, "--curve", "gap=3:5", "--figure", "curves.svg")
    assert answer.code != 0 and "has no parameter 'gap'" in answer.err
    assert not (tmp_path / "curves.svg").exists()


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


def test_a_declared_map(stickslip):
    """Henon's map, b = 0.3: the fixed point flips at a = 3 (1 - b)^2 / 4, its cycle at a = (1 - b)^2 + (1 + b)^2 / 4."""
    asked = ("branch", "henon", "--set", "a=0.2", "--settle", "--over", "a=0.1:1", "--switch", "all", "--json")
    answer = stickslip(*asked)
    assert answer.code == 0
    found = [one["value"] for of in json.loads(answer.out)["branches"] for one in of["special"]]
    assert found == pytest.approx([0.3675, 0.9125], abs=1e-10)
