"""Diagrams, basins, exponents, charts, sections and spectra from the shell."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
import xarray

SUPPORT = ("discontinuous_support", "--forcing", "omega")
SCENE = Path(__file__).parents[2] / "data" / "scenes" / "hinge_clearance_figure_4.toml"


def test_a_diagram_with_table_and_picture(stickslip, tmp_path):
    asked = ("diagram", *SUPPORT, "--over", "omega=0.9:1.1:5", "--start", "x=0", "--direction", "both")
    answer = stickslip(*asked, "-o", "d.csv", "--figure", "d.png", "--json")
    assert answer.code == 0 and answer.json["periods"] == [[1] * 5, [1] * 5]
    assert answer.json["words"][0][0] == "1-0" and answer.json["files"] == ["d.csv", "d.png"]
    rows = list(csv.DictReader((tmp_path / "d.csv").read_text("utf-8").splitlines()))
    assert len(rows) == 10 and {row["direction"] for row in rows} == {"up", "down"}
    assert (tmp_path / "d.png").read_bytes().startswith(b"\x89PNG")
    again = stickslip(*asked, "-o", "d.csv")
    assert again.code == 2 and "exists" in again.err


def test_basins_as_a_data_set(stickslip, tmp_path):
    asked = ("--set", "omega=1.18", "--over", "x=-8:8:9", "--over", "v=-8:8:9")
    answer = stickslip("basins", *SUPPORT, *asked, "-o", "b.nc", "--json")
    assert answer.code == 0 and sum(answer.json["shares"]) == pytest.approx(1.0)
    assert [one["period"] for one in answer.json["attractors"]] == [1, 1]
    with xarray.open_dataset(tmp_path / "b.nc", engine="scipy") as found:
        assert found["attractor"].values.tolist() == answer.json["labels"]


def test_a_store_goes_on_and_is_read(stickslip, tmp_path):
    asked = (
        "basins",
        *SUPPORT,
        "--set",
        "omega=1.18",
        "--over",
        "x=-8:8:9",
        "--over",
        "v=-8:8:9",
        "-o",
        "b.zarr",
        "--json",
    )
    first = stickslip(*asked, "--resume", "--workers", 2)
    assert first.code == 0 and first.json["files"] == ["b.zarr"]
    with xarray.open_zarr(tmp_path / "b.zarr", consolidated=False, chunks=None) as found:
        assert found["attractor"].values.tolist() == first.json["labels"] and found.attrs["finished"]
    # what is made now is counted anew, all else is what was stored
    assert {**stickslip(*asked).json, "how": ""} == {**first.json, "how": ""}
    other = stickslip(*asked, "--most", 10)
    assert other.code == 2 and "most = 3000 there, 10 here" in other.err


def test_exponents_of_a_map_a_model_and_a_scene(stickslip):
    henon = stickslip("lyapunov", "henon", "--steps", 20_000, "--json").json
    assert henon["exponents"][0] == pytest.approx(0.419, abs=0.02) and henon["unit"] == "1"
    hinge = stickslip("lyapunov", SCENE, "--steps", 400, "--transient", 20, "--json").json
    assert len(hinge["exponents"]) == 2 and hinge["zero"] is None
    assert "2 Lyapunov exponents" in stickslip("lyapunov", "henon", "--steps", 2000).out


def test_a_family_takes_from_its_scene_what_it_is_not_given(stickslip):
    whole = stickslip("diagram", "bouncing_ball_diagram", "--json").json
    assert len(whole["values"]) == 141 and whole["periods"][0][0] == 1 and 8 in whole["periods"][0]
    asked = ("--over", "A=0.003:0.0031:2", "--direction", "down")
    part = stickslip("diagram", "bouncing_ball_diagram", *asked, "--json").json
    assert part["values"] == [0.003, 0.0031] and part["directions"] == ["down"] and part["periods"] == [[1, 1]]
    basins = stickslip("basins", "bouncing_ball_diagram")
    assert basins.code == 2 and "A range for each axis is needed" in basins.err


def test_a_chart_a_section_and_a_spectrum(stickslip):
    rig = ("disc_rig", "--period", 1, "--autonomous", "--what", "stick", "--transient", 34, "--points", 6)
    found = stickslip("chart", *rig, "--over", "w0=0.2:1.8:3", "--over", "w1=-0.6:1:3", "--json").json
    assert found["runs"] == 9 and set(found["classes"]) <= {"none", "disc0", "disc1", "disc0, disc1"}
    section = stickslip("section", *SUPPORT, "--level", "v=0", "--down", "--points", 3, "--json").json
    assert [point[0] for point in section["points"]] == pytest.approx([4.334229130298108] * 3, abs=1e-12)
    lines = stickslip("spectrum", "hinge_clearance", "--forcing", "f", "--set", "f=0.429", "--json").json
    assert lines["lines"] and lines["period"] == 1
    assert lines["amplitude"][1] == pytest.approx(0.03590083221883138, abs=1e-12)


def test_a_return_map_without_a_scene(stickslip):
    """The least angle of the woodpecker on its periodic motion, as the event-driven code of test_woodpecker has it."""
    toy = ("woodpecker", "--level", "w_S=0", "--returns", "phi_S", "--cap", 4, "--json")
    least = stickslip("section", *toy, "--accept", "lower_friction=0", "--transient", 40, "--points", 2).json
    assert least["states"] == ["phi_S"] and least["points"] == [pytest.approx([-0.529471967111], abs=1e-11)] * 2
    other = stickslip("section", *toy, "--start", "y=1", "--transient", 0, "--points", 1).json["points"]
    assert other == [pytest.approx([-0.529471967111], abs=1e-11)]  # from any height
    never = stickslip("section", *toy[:-3], "--cap", 0.5, "--accept", "lower_friction=3")
    assert never.code == 2 and "does not return within 0.5 s" in " ".join(never.err.split())
    follows = ("--accept", "lower_friction=0", "--over", "eN1=0.17:0.2", "--box", "phi_S=-0.8:-0.7", "--scans", 3)
    asked = (*follows, "--noise", 1e-11, "--accuracy", 1e-10)
    (collision,) = stickslip("crossings", *toy, *asked).json["special"]
    assert (collision["value"], collision["x"]) == pytest.approx((0.1851269509, -0.7577872573), abs=1e-9)


def test_a_scene_says_how_many_periods_of_the_forcing_a_step_takes(stickslip):
    """Its motion repeats after three of them, which is one step."""
    assert stickslip("spectrum", "discontinuous_support_period_3", "--json").json["period"] == 1


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("diagram", "discontinuous_support", "--over", "omega=0.9:1:3"), "needs a period"),
        (("diagram", *SUPPORT, "--over", "omega=0.9:1"), "NAME=FROM:TO:COUNT"),
        (("diagram", *SUPPORT, "--over", "omega=0.9:1:3", "--resume"), "goes on with a store"),
        (("section", *SUPPORT, "-o", "s.zarr"), "must end in one of .csv, .nc"),
        (("diagram", *SUPPORT, "--over", "omega=0.9:1:3", "--over", "f0=0:1:3"), "1 range is needed"),
        (("basins", *SUPPORT, "--over", "y=0:1:3"), "no state 'y'"),
        (("section", *SUPPORT, "--level", "x=0", "--impacts", "support"), "name one of them"),
        (("crossings", "woodpecker", "--returns", "phi_S", "--over", "eN1=0:1"), "--level STATE=VALUE --returns STATE"),
        (("section", "woodpecker", "--level", "w_S=0", "--cap", "4"), "--level STATE=VALUE --returns STATE"),
        (("section", *SUPPORT, "--level", "x=0", "--returns", "v"), "and no period"),
        (("crossings", "woodpecker", "--level", "w_S=0", "--over", "eN1=0:1"), "Take a return map of one state"),
        (("section", "henon", "--period", "1"), "is a map"),
        (("section", "henon", "--level", "x=0", "--returns", "x"), "is a map"),
        (("spectrum", "henon"), "is a map"),
        (("lyapunov", "henon", "-o", "x.txt"), ".csv"),
        (("lyapunov", "henon", "--figure", "x.gif"), "known format"),
        (("diagram", "henon", "--over", "a=1:1.4:3", "--interactive", "x.png"), "end it in .html"),
    ],
)
def test_bad_arguments_are_refused(stickslip, tmp_path, arguments, said):
    answer = stickslip(*arguments)
    assert answer.code == 2 and said in " ".join(answer.err.split())
    assert list(tmp_path.iterdir()) == []


def test_a_branch_from_the_shell(stickslip, tmp_path):
    asked = ("branch", *SUPPORT, "--set", "omega=1.3", "--over", "omega=1.04:1.35", "--start", "x=0", "--settle")
    answer = stickslip(*asked, "-o", "b.csv", "--figure", "b.png", "--json")
    assert answer.code == 0, answer.err
    (found,) = answer.json["branches"]
    assert sorted(one["kind"] for one in found["special"]) == ["fold", "fold", "grazing, compliant"]
    assert {one["kind"] for one in found["ends"]} == {"range"}
    assert (tmp_path / "b.png").read_bytes().startswith(b"\x89PNG")
    rows = list(csv.DictReader((tmp_path / "b.csv").read_text("utf-8").splitlines()))
    assert len(rows) == found["points"] and {row["stable"] for row in rows} == {"True", "False"}


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (("--over", "omega=0.8"), "NAME=FROM:TO"),
        (("--over", "omega=1.2:1.4"), "not between 1.2 and 1.4"),
        (("--over", "omegaa=0.8:1.4"), "omega"),
        (("--over", "omega=0.8:1.4", "--start", "x=300"), "No periodic motion"),
        (("--over", "omega=0.8:1.4", "--switch", "some"), "none or all"),
        (("--over", "omega=0.8:1.4", "--of", "y"), "no state 'y'"),
        (("--over", "omega=-1:1.4"), "at least 0.0"),
    ],
)
def test_a_branch_refuses(stickslip, asked, said):
    answer = stickslip("branch", *SUPPORT, *asked)
    assert answer.code == 2 and said in answer.err and not answer.out


def test_borders_shocks_and_shares_take_numbers_and_ranges_of_states(stickslip, tmp_path):
    asked = (*SUPPORT, "--set", "ks=10", "--set", "omega=1.18")
    edge = stickslip("edge", *asked, "--other", "x=-0.5", "--other", "v=6.5", "--figure", "e.png", "--json").json
    assert edge["between"] == ["1-0", "1-1"] and len(edge["multipliers"]) == 2
    shock = stickslip("shock", *asked, "--weights", "v=2", "--figure", "s.png", "--json").json
    assert shock["shock"][0] == 0.0 and shock["size"] == pytest.approx(2 * abs(shock["shock"][1]))
    over = (*SUPPORT, "--set", "ks=10", "--over", "omega=1.18:1.2:2", "--box", "x=-8:8", "--box", "v=-8:8")
    shares = stickslip("shares", *over, "--starts", 50, "-o", "s.csv", "--figure", "p.png", "--json").json
    assert [tip["kind"] for tip in shares["tips"]] == ["lost"] and sum(shares["shares"][0]) == pytest.approx(1.0)
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
    missing = stickslip("shares", *over[:-4])
    assert missing.code == 2 and "where starts of discontinuous_support are drawn from" in missing.err
    wrong = stickslip("shares", *over[:-2], "--box", "v=3")
    assert wrong.code == 2 and "NAME=FROM:TO" in wrong.err
