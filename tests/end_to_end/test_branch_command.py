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


def test_a_resonance_curve_over_its_closed_form(stickslip, tmp_path):
    form = "f0/sqrt((k - m*omega**2)**2 + (c*omega)**2)"
    asked = (*SUPPORT, "--of", "max(x)", "--closed-form", form)
    answer = stickslip(*asked, "--figure", "a.svg", "--json")
    (told,) = (one["amounts"] for one in json.loads(answer.out)["branches"])
    assert max(told["max(x)"]) > 5.1 and len(told["special"]) == 4
    assert len(told["d max(x)/d omega"]) == len(told["omega"])
    picture = (tmp_path / "a.svg").read_text("utf-8")
    assert "max(x): closed form" in picture and "largest x (m)" in picture
    answer = stickslip(*SUPPORT, "--of", "mix(x)")
    assert answer.code != 0 and "Did you mean 'min'" in answer.err


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


def test_a_declared_map(stickslip):
    """Henon's map, b = 0.3: the fixed point flips at a = 3 (1 - b)^2 / 4, its cycle at (1 - b)^2 + (1 + b)^2 / 4."""
    asked = ("branch", "henon", "--set", "a=0.2", "--settle", "--over", "a=0.1:1", "--switch", "all", "--json")
    answer = stickslip(*asked)
    assert answer.code == 0
    found = [one["value"] for of in json.loads(answer.out)["branches"] for one in of["special"]]
    assert found == pytest.approx([0.3675, 0.9125], abs=1e-10)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        # no motion near the start: the nearest miss, and what to try
        (
            (*SUPPORT[:5], "omega=1.15", "--over", "omega=1.1:1.25"),
            ("No periodic motion", "the nearest, from x = 5.28", "misses its start by 0.45", "--settle", "--every"),
        ),
        (
            ("branch", "disc_rig", "--autonomous", "--period", "1", "--over", "w0=0.5:1"),
            ("misses its start", "check its period, about 1 s"),
        ),
        # what nothing forces, and comes to rest
        (("branch", "drive_motor", "--over", "M=0.35:0.5"), ("comes to no cycle", "needs a period", "--period")),
        (("branch", "block_on_belt", "--period", "5", "--over", "v_belt=0.1:0.2"), ("else say so", "--autonomous")),
        # ranges
        ((*SUPPORT[:5], "omega=0.8", "--over", "ks=-5:20"), ("must be at least 0.0 N/m, found -5",)),
        ((*SUPPORT[:5], "omega=0.8", "--over", "omega=0.8:nan"), ("from one finite value to another", "nan")),
        ((*SUPPORT[:5], "omega=0.8", "--over", "omega=0.9:1"), ("omega = 0.8, which is not between 0.9 and 1",)),
        ((*SUPPORT, "--resume"), ("goes on with a store",)),
    ],
)
def test_what_cannot_be_followed_is_told(stickslip, tmp_path, asked, said):
    answer = stickslip(*asked, "-o", "branch.csv") if "--resume" not in asked else stickslip(*asked)
    assert answer.code not in (0, 130) and all(one in answer.err.replace("\n", " ") for one in said), answer.err
    assert not list(tmp_path.iterdir())


def test_a_store_goes_on_by_command(stickslip, tmp_path):
    pytest.importorskip("zarr")
    asked = (*SUPPORT[:6], "--over", "omega=0.8:0.86", "-o", "run.zarr")
    first = stickslip(*asked, "--json")
    assert first.code == 0 and (tmp_path / "run.zarr").is_dir()
    again = stickslip(*asked, "--json")
    assert json.loads(again.out) == json.loads(first.out)
    other = stickslip(*asked[:7], "omega=0.8:0.87", *asked[8:])
    assert other.code != 0 and "made otherwise: between" in other.err
