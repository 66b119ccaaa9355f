"""The commands that follow an equilibrium and grow manifolds of saddles: what they write, draw and refuse."""

from __future__ import annotations

import json
import signal
from contextlib import contextmanager

import pytest

from fmu_models.base import console

HOPF = ("equilibria", "planar_hopf", "--over", "mu=-1:1", "--start", "x1=-1.5", "--start", "x2=0")


def test_a_discontinuous_hopf_point_with_its_cycle(stickslip, tmp_path):
    answer = stickslip(*HOPF, "--switch", "all", "--of", "eigenvalues", "--figure", "path.svg", "-o", "e.csv", "--json")
    assert answer.code == 0
    told = json.loads(answer.out)
    (special,) = told["special"]
    assert special["kind"] == "discontinuous Hopf"
    (crossing,) = special["crossings"]["imaginary axis"]
    assert crossing["q"] == pytest.approx(1 / 6) and crossing["eigenvalues"][0] == pytest.approx([0.0, 1.0], abs=1e-12)
    assert {point["stable"] for point in told["points"] if point["value"] > 0.0} == {False}
    (cycles,) = told["cycles"]
    assert cycles["last"]["period"] == pytest.approx(7.161378395771369)
    assert "imaginary axis" in (tmp_path / "path.svg").read_text("utf-8")
    assert "eigenvalue2_imag" in (tmp_path / "e.csv").read_text("utf-8")


def test_a_scene_says_the_range_and_the_picture(stickslip, tmp_path):
    answer = stickslip("equilibria", "planar_multiple_crossing_figure_3", "--figure", "figure_3.svg")
    said = " ".join(answer.out.split())
    assert answer.code == 0 and "multiple crossing at mu" in said and "two equilibria meet" in said
    assert "multiple crossing" in (tmp_path / "figure_3.svg").read_text("utf-8")


def test_special_equilibria_are_curves_in_two_parameters(stickslip, tmp_path):
    """Of the smoothed system mu eps alone matters."""
    smooth = ("planar_multiple_crossing_smooth", "--over", "mu=-0.01:0.02", "--start", "x1=-0.05")
    answer = stickslip("equilibria", *smooth, "--curve", "eps=10:40", "--figure", "curves.svg", "--json")
    assert answer.code == 0
    hopf, fold = json.loads(answer.out)["curves"]
    for one, known in ((hopf, 0.0025561976547262552), (fold, 0.0051946258921224642)):
        assert [eps * mu for eps, mu in one["points"]] == pytest.approx([20.0 * known] * len(one["points"]), rel=1e-8)
    assert (tmp_path / "curves.svg").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("forced_stick_slip", "--over", "omega=1:2"), "is forced"),
        (("logistic", "--over", "r=1:2"), "is a map"),
        (("planar_hopf", "--over", "mu=-1:1", "--of", "x3"), "no state 'x3'"),
        (("planar_hopf", "--over", "mu=-1:1", "--switch", "some"), "--switch takes none or all"),
    ],
)
def test_what_cannot_be_followed_is_told(stickslip, tmp_path, arguments, said):
    answer = stickslip("equilibria", *arguments, "--figure", "e.svg")
    assert answer.code != 0 and said in " ".join(answer.err.split())
    assert not (tmp_path / "e.svg").exists()


SADDLE = ("manifolds", "planar_multiple_crossing_smooth", "--start", "x1=0.003", "--start", "x2=-0.003")


def test_manifolds_are_written_and_drawn(stickslip, tmp_path):
    answer = stickslip(*SADDLE, "--set", "mu=-0.0014", "--length", "2", "--figure", "m.svg", "-o", "m.csv", "--json")
    assert answer.code == 0
    told = json.loads(answer.out)
    assert [one["kind"] for one in told["curves"]] == ["unstable", "unstable", "stable", "stable"]
    assert len((tmp_path / "m.csv").read_text("utf-8").splitlines()) == 1 + sum(
        len(one["points"]) for one in told["curves"]
    )
    assert (tmp_path / "m.svg").exists()


def test_the_homoclinic_point_is_told(stickslip, tmp_path):
    answer = stickslip(*SADDLE, "--homoclinic", "mu=-0.003:0", "--figure", "h.svg")
    assert answer.code == 0 and "mu = -0.00139851883427" in answer.out and "an unstable cycle" in answer.out
    assert (tmp_path / "h.svg").exists()


def test_a_homoclinic_point_takes_no_section(stickslip):
    answer = stickslip(*SADDLE, "--homoclinic", "mu=-0.003:0", "--period", "1")
    assert answer.code != 0 and "leave the section out" in " ".join(answer.err.split())


def test_an_interrupt_keeps_the_equilibria_so_far(stickslip, monkeypatch):
    """A real signal, raised as the tenth is told of; no cycle is begun after it."""

    @contextmanager
    def progress(doing):
        told = []

        def advance(fraction):
            told.append(fraction)
            if len(told) == 10:
                signal.raise_signal(signal.SIGINT)

        yield advance

    monkeypatch.setattr(console, "progress", progress)
    answer = stickslip(*HOPF, "--set", "mu=-0.5", "--switch", "all", "--json")
    assert answer.code == 130
    told = json.loads(answer.out)
    assert len(told["points"]) == 10 and not told["cycles"]
    assert {one["kind"] for one in told["ends"]} == {"interrupted"}
