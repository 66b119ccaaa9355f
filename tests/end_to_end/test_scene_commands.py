"""Scenes at the command line."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import fmpy
import pytest

from fmu_models import Fmu
from fmu_models.base.shipped import folder, scenes
from identification import cli

ROOT = Path(__file__).parents[2]
RIGS = ROOT / "data" / "rigs" / "paper_rubber"
CLASS_A = ROOT / "data" / "scenes" / "disc_rig_class_a.toml"


@pytest.fixture
def stickslip(monkeypatch, capsys, tmp_path):
    """Run the command in an empty folder, in this process: exit code, standard output, standard error."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["stickslip", *(str(argument) for argument in arguments)])
        with pytest.raises(SystemExit) as stopped:
            cli.main()
        printed = capsys.readouterr()
        return int(stopped.value.code or 0), printed.out, printed.err

    return run


def test_scenes_are_listed(stickslip):
    code, out, _ = stickslip("scene", "--json")
    assert code == 0
    assert {row["name"] for row in json.loads(out)["scenes"]} == {path.stem for path in scenes()}
    assert "disc_rig_figure_8" in stickslip("scene")[1]


def test_a_scene_is_shown_run_and_compared(stickslip, tmp_path):
    code, out, _ = stickslip("scene", "disc_rig_class_a", "-o", "out.csv", "--figure", "out.svg", "--json")
    content = json.loads(out)
    assert code == 0 and content["passed"]
    assert [row["at"] for row in content["results"]] == [0.2, 0.41, 0.83]
    assert len(content["comparisons"]) == 12
    header, first = (tmp_path / "out.csv").read_text().splitlines()[:2]
    assert header.startswith("w0,period,events,theta_min") and first.startswith("0.2,1.15723")
    assert "<svg" in (tmp_path / "out.svg").read_text()
    told = stickslip("scene", "disc_rig_class_a")[1]
    assert "paper/rubber" in told and "against what is known" in told


def test_a_known_value_that_is_missed_is_an_error(stickslip, tmp_path):
    (tmp_path / "wrong.toml").write_text(CLASS_A.read_text().replace("1.157232571396", "1.157232571399"))
    code, out, _ = stickslip("scene", "wrong.toml")
    assert code == 0, "a change beyond the tolerance of 1e-9 is none"
    (tmp_path / "wrong.toml").write_text(CLASS_A.read_text().replace("1.157232571396", "1.16"))
    code, out, _ = stickslip("scene", "wrong.toml")
    assert code == 1 and "differs" in out


def test_another_constant_is_a_departure_and_nothing_is_compared(stickslip, tmp_path):
    """Against the same scene with the constant in its file; what is varied, and what there is none of, is refused."""
    code, out, _ = stickslip("scene", "hinge_clearance_transient", "--set", "f=0.414", "--json")
    content = json.loads(out)
    assert code == 0 and content["scene"]["departs"] == {"f": 0.429} and content["scene"]["fixed"]["f"] == 0.414
    assert all(one["departs"] and one["error"] is None for one in content["comparisons"])
    text = (ROOT / "data" / "scenes" / "hinge_clearance_transient.toml").read_text()
    (tmp_path / "own.toml").write_text(text.replace("f = 0.429", "f = 0.414").partition("[[reference]]")[0])
    (own,) = json.loads(stickslip("scene", "own.toml", "--json")[1])["results"]
    assert content["results"][0]["values"] == own["values"]
    told = stickslip("scene", "hinge_clearance_transient", "--set", "f=0.414")[1]
    assert "f = 0.414, not 0.429" in told and "not compared: departs" in told
    code, _, said = stickslip("scene", "hinge_clearance_transient", "--set", "delt=0.1")
    assert code == 2 and "Did you mean 'delta'?" in said
    code, _, said = stickslip("scene", "hinge_clearance_exponents", "--set", "f=0.4")
    assert code == 2 and "varies" in said
    code, _, said = stickslip("scene", "disc_rig_class_a", "--set", "N0=9 m")
    assert code == 2 and "cannot be converted to N" in said


def test_explain_says_what_is_left_out_and_what_that_saves(stickslip):
    code, out, _ = stickslip("scene", CLASS_A, "--explain", "--json")
    assert code == 0
    content = json.loads(out)["explained"]
    assert {"kind": "contact", "name": "disc1", "why": "not among the contacts in use"} in content["left_out"]
    small, large = content["sizes"]["scene"], content["sizes"]["model"]
    assert all(small[what] < large[what] for what in ("contacts", "indicators", "parameters", "outputs", "bytes"))


def test_simulate_and_export_take_a_scene(stickslip, tmp_path):
    code, out, _ = stickslip("simulate", CLASS_A, "--until", 10, "--input", "w0=0.41", "--json")
    content = json.loads(out)
    assert code == 0
    assert content["model"] == "disc_rig_class_a" and content["contacts"]["disc0"]["events"] == 18
    assert set(content["ranges"]) == {"theta", "omega", "F0"}
    assert stickslip("export", CLASS_A, "--fmi", "2.0")[0] == 0
    description = fmpy.read_model_description(tmp_path / "disc_rig_class_a.fmu")
    assert description.fmiVersion == "2.0"
    assert not [v for v in description.modelVariables if v.causality == "parameter"]


def test_simulate_states_its_error_and_time(stickslip):
    code, out, _ = stickslip("simulate", CLASS_A, "--error")
    assert code == 0 and "error estimate" in out and "defect" in out and "run time" in out
    told = json.loads(stickslip("simulate", "disc_rig", "--contacts", "disc0", "--error", "--json")[1])
    assert 0 < told["error"]["relative"] < 1e-12
    assert told["error"]["companions"] == ["other steps", "tolerance/10", "data up", "data down"]
    assert told["error"]["seconds"][0] == told["seconds"] > 0


@pytest.mark.nightly
def test_a_scene_is_emulated_fitted_and_compared(stickslip, tmp_path):
    """The whole road: one log per drive speed of the scene, a fit, and the portraits of the scene's own FMU."""
    text = CLASS_A.read_text().split("[[reference]]")[0].replace("[0.2, 0.41, 0.83]", "[0.41, 0.83, 1.4]")
    (tmp_path / "mine.toml").write_text(text)
    code, out, err = stickslip("emulate", "mine.toml", "logs", "--seed", 1, "--json")
    assert code == 0, err
    assert [log["file"] for log in json.loads(out)["logs"]] == ["mine-0.41.csv", "mine-0.83.csv", "mine-1.4.csv"]
    truth = json.loads((tmp_path / "logs" / "datapackage.json").read_text())
    assert "mine" in json.dumps(truth)
    assert stickslip("fit", RIGS, "--result", "fit.json")[0] == 0
    code, out, err = stickslip("compare", "fit.json", "logs", "--scene", "mine.toml", "--json")
    assert code == 0, err
    assert json.loads(out)["passed"]


def test_the_class_with_a_changeover_is_emulated_too(stickslip, tmp_path):
    assert stickslip("emulate", ROOT / "data" / "scenes" / "disc_rig_class_c.toml")[0] == 0
    package = json.loads((tmp_path / "disc_rig_class_c" / "datapackage.json").read_text())
    assert "theta_s" in json.dumps(package)


SCENE = """title = "t"
model = "disc_rig"
contacts = ["disc0"]
stop_time = 1
[sensors]
laser = true
"""


@pytest.mark.parametrize(
    ("arguments", "text", "said"),
    [
        (["scene", "s.toml"], SCENE.replace("disc0", "disc9"), "s.toml, line 3: disc_rig has no contact 'disc9'"),
        (["scene", "disc_rig_figur_8"], SCENE, "Did you mean 'disc_rig_figure_8'"),
        (["simulate", "s.toml", "--set", "N0=3"], SCENE, "Move it to [free]"),
        (["simulate", "s.toml", "--input", "w1=3"], SCENE, "has no input 'w1'"),
        (["simulate", "s.toml", "--contacts", "disc1"], SCENE, "says itself which contacts"),
        (["export", "s.toml", "--set", "N0=3"], SCENE, "Move it to [free]"),
        (["export", "s.toml", "--set", "M=3"], SCENE, "no free parameter 'M'"),
        (["export", "s.toml", "--set", "N0=-3"], SCENE + "[free]\nN0 = 3\n", "out of range"),
        (["emulate", "s.toml", "--duration", "3"], SCENE, "A scene says itself what is emulated"),
        (["emulate", "s.toml"], SCENE.replace("laser", "lasr"), "line 6: 'lasr' is not a key in [sensors]"),
        (["emulate", "s.toml"], SCENE.replace("true", "3"), "line 6: 'laser' must be true or false"),
        (["emulate", "s.toml"], SCENE + 'transient = "5 m"', "line 7: 'transient' = \"5 m\" cannot be converted"),
        (["emulate", "s.toml"], SCENE.replace('"disc0"', '"disc1"'), "disc 0, both discs or none"),
        (["emulate", "s.toml"], SCENE.replace("disc_rig", "block_on_belt").replace("disc0", "belt"), "is not the rig"),
        (["emulate", "one", "two"], SCENE, "Two folders are given"),
        (["compare", "fit.json", RIGS, "--scene", "s.toml"], SCENE.replace('"disc0"', ""), "as contacts in use: none"),
    ],
)
def test_bad_input_is_refused_with_a_reason(stickslip, tmp_path, arguments, text, said):
    (tmp_path / "s.toml").write_text(text)
    if "fit.json" in arguments:
        assert stickslip("fit", RIGS, "--result", "fit.json")[0] == 0
    before = set(tmp_path.rglob("*"))
    code, _, err = stickslip(*arguments)
    assert code == 2
    assert said in err and "Traceback" not in err
    assert set(tmp_path.rglob("*")) == before


@pytest.mark.nightly
def test_a_fit_without_a_figure_loads_neither_matplotlib_nor_sympy(tmp_path):
    """In a fresh interpreter; what it does load is what it computes with."""
    code = (
        f"import sys; sys.argv = ['stickslip', 'fit', {str(RIGS)!r}, '--json']\n"
        "from identification import cli\n"
        "try: cli.main()\n"
        "except SystemExit as stopped: assert not stopped.code, stopped.code\n"
        "heavy = {'matplotlib', 'sympy', 'pint', 'jinja2'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.DEVNULL, cwd=tmp_path)


def test_a_scene_elsewhere_needs_no_folder_of_ours(stickslip, tmp_path):
    shutil.copy(CLASS_A, tmp_path / "copy.toml")
    assert stickslip("scene", "copy.toml")[0] == 0


def test_a_scene_of_a_map_is_told_and_exported_and_its_limits_too(stickslip):
    assert "multiplier1_real" in stickslip("scene", "ikeda")[1]
    code, _, err = stickslip("scene", "ikeda", "--figure", "ikeda.png")
    assert code == 2 and "There is no motion to draw: of a map" in err
    code, _, err = stickslip("explore", "ikeda", "-o", "ikeda.html")
    assert code == 2 and "is of a map, which has no live page" in err
    assert stickslip("export", "ikeda", "-o", "ikeda.fmu")[0] == 0
    run = Fmu.open("ikeda.fmu")
    assert run.parameters == ["period"]  # the others are constants of its rule


def test_families_take_the_file_of_a_map(stickslip):
    file = str(folder("systems_of_the_literature") / "cubic_map.py")
    code, out, _ = stickslip("basins", file, "--over", "x=-1:1:4", "--json")
    assert code == 0 and len(json.loads(out)["attractors"]) == 2
    code, _, err = stickslip("basins", file, "--over", "x=-1:1:4", "--period", "2")
    assert code == 2 and "is a map" in err
