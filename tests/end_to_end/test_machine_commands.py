"""The commands for logs of other machines, as a user meets them."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from machine_log import FRICTION

from rig_io.readers.csv_log import write

RECIPE = """title = "a [slide]"
[signals.time]
column = "time"
unit = "s"
[signals.position]
column = "x"
unit = "m"
[signals.effort]
column = "F"
unit = "N"
[sampling]
rate = "1 kHz"
drop = 5
[terms]
M = "inertia"
Fc = "coulomb"
[friction]
compare = ["Coulomb", "Coulomb+viscous"]
"""
SLIPS = f"""title = "saw"
{FRICTION}[slips]
mass = 0.1
"""


@pytest.fixture
def slide(tmp_path: Path) -> tuple[Path, Path]:
    time = np.arange(5000) / 1000
    w = 2 * np.pi * 1.3
    x, v, a = np.sin(w * time), w * np.cos(w * time), -(w**2) * np.sin(w * time)
    write(tmp_path / "log.csv", {"time": time, "x": x, "v": v, "F": 2 * a + 4 * np.sign(v)})
    (tmp_path / "slide.toml").write_text(RECIPE)
    return tmp_path / "slide.toml", tmp_path / "log.csv"


@pytest.fixture
def saw(tmp_path: Path) -> tuple[Path, Path]:
    tooth = np.concatenate([np.linspace(0.3, 0.4, 300), np.linspace(0.4, 0.3, 30)])
    friction = np.tile(tooth, 20)
    write(tmp_path / "saw.csv", {"time": np.arange(len(friction)) / 1000, "f": friction})
    (tmp_path / "saw.toml").write_text(SLIPS)
    return tmp_path / "saw.toml", tmp_path / "saw.csv"


def test_help_shows_examples(stickslip):
    for command in ("inverse", "slips"):
        assert command in stickslip("--help").out
        assert f"Example: stickslip {command}" in stickslip(command, "--help").out


DATA = Path(__file__).parents[2] / "data" / "machines"


def test_the_logs_that_come_along_give_their_machines_back(stickslip):
    """As the README calls them; truths of data/README.md."""
    axis = stickslip("inverse", "axis", DATA / "axis.csv", "--json").json
    truth = {"M": 20.0, "Fv": 60.0, "Fc": 12.0, "offset": -1.5}
    for one in axis["parameters"]:
        assert abs(one["value"] - truth[one["name"]]) < 2.5 * one["standard_deviation"]
    assert axis["laws"]["position"]["scores"][0]["law"] == "Coulomb+viscous"
    slider = stickslip("slips", "slider", DATA / "slider.csv", "--json").json
    assert (slider["model"]["mu_s"], slider["model"]["mu_k"]) == pytest.approx((0.6, 0.45), rel=0.005)


def test_inverse_prints_tables_and_json_and_writes_both_files(stickslip, slide, tmp_path):
    recipe, log = slide
    told = stickslip("inverse", recipe, log, "--held-out", log, "--figure", "friction.png", "-o", "fit.json")
    assert told.code == 0, told.err
    for word in ("a [slide]", "M", "inertia", "sd if white", "Relative errors", "preferred", "written: fit.json"):
        assert word in told.out
    assert (tmp_path / "friction.png").stat().st_size > 10_000
    kept = json.loads((tmp_path / "fit.json").read_text())
    assert {e["name"]: e["value"] for e in kept["parameters"]} == pytest.approx({"M": 2.0, "Fc": 4.0}, rel=1e-3)
    shown = stickslip("inverse", recipe, log, "--json").json
    assert shown["parameters"] == kept["parameters"]
    assert shown["laws"]["position"]["scores"][0]["law"] == "Coulomb"
    assert stickslip("inverse", recipe, log, "-o", "fit.json").code == 2


def test_slips_prints_tables_and_json_and_draws(stickslip, saw, tmp_path):
    recipe, log = saw
    settings = ("--set", "stiffness=100", "--set", "speed=0.0033")
    told = stickslip("slips", recipe, log, *settings, "--figure", "slips.svg")
    assert told.code == 0, told.err
    for word in ("slip events", "peak friction", "Block on a belt", "Loading in stick", "written: slips.svg"):
        assert word in told.out
    assert "<svg" in (tmp_path / "slips.svg").read_text()
    found = stickslip("slips", recipe, log, *settings, "--json").json
    assert found["events"] == pytest.approx(19, abs=1)
    assert found["period"]["value"] == pytest.approx(0.33, rel=0.01)
    assert len(found["table"]["peak"]) == found["events"]
    assert found["table"]["interval"][0] is None  # there is none before the first
    assert found["model"]["mu_s"] > found["model"]["mu_k"]
    without = stickslip("slips", recipe, log, "--set", "smoothing=0.005", "--json").json
    assert without["model"] is None and without["loading_expected"] is None


def test_faults_are_said_on_one_line_and_leave_nothing(stickslip, slide, saw, tmp_path):
    recipe, log = slide
    before = {path.name for path in tmp_path.iterdir()}
    for arguments, word in (
        (("inverse", "emsp", log), "Did you mean 'emps'"),
        (("inverse", recipe, "nothing.csv"), "no log 'nothing.csv'"),
        (("inverse", recipe, log, "--figure", "fit.jpeg"), "no known format"),
        (("inverse", saw[0], saw[1]), "one for 'stickslip slips'"),
        (("slips", recipe, log), "one for 'stickslip inverse'"),
        (("slips", *saw, "--set", "stifness=2"), "Did you mean 'stiffness'"),
        (("slips", *saw), "give stiffness="),
    ):
        answer = stickslip(*arguments)
        assert answer.code == 2
        assert word in answer.err
        assert not answer.out
    assert {path.name for path in tmp_path.iterdir()} == before


@pytest.mark.nightly_for("command0-heavy0")
@pytest.mark.parametrize(
    ("command", "heavy"),
    # the terms of a machine are declared, and declarations are SymPy's; a slider is simulated as an FMU
    [
        (("inverse", "axis", "axis.csv"), {"matplotlib", "fmpy"}),
        (("slips", "slider", "slider.csv"), {"matplotlib", "sympy"}),
    ],
)
def test_without_a_figure_what_is_heavy_is_not_loaded(command, heavy):
    name, recipe, log = command
    code = (
        f"import sys; sys.argv = ['stickslip', {name!r}, {recipe!r}, {str(DATA / log)!r}]\n"
        "from identification import cli\n"
        "try: cli.main()\n"
        "except SystemExit as end: assert not end.code\n"
        # nor jinja2, but that pint loads dask where it is installed, and dask loads it
        f"heavy = {heavy!r} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.DEVNULL)
