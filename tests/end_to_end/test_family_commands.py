"""Compare, report and apply as a user meets them, on a family of drive speeds that reaches beyond its bifurcation."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import fmpy
import pytest

from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from identification.commands import fit as commands
from identification.fit.fit import fit_friction
from rig_io.bench.emulator import emulate_set, standard_set
from rig_io.packages.datapackage import read_package

RIGS = Path(__file__).parents[2] / "data" / "rigs" / "paper_rubber"
SCENE = Path(__file__).parents[2] / "data" / "scenes" / "disc_rig_class_a.toml"


@pytest.fixture(scope="module")
def fit(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("fit") / "fit.json"
    path.write_text(fit_friction(read_package(RIGS), estimator="weak-form").to_json(), "utf-8")
    return path


@pytest.fixture(scope="module")
def family(tmp_path_factory) -> Path:
    """Logs of 8 s at four drive speeds; stick-slip ends at 2.382 rad/s."""
    folder = tmp_path_factory.mktemp("family") / "logs"
    settings = standard_set("paper/rubber", (1.6, 1.9, 2.2, 2.8), duration=8.0, transient=8.0)
    return emulate_set(folder, settings[:-1], seed=3)


@pytest.mark.nightly
def test_a_family_is_compared_beyond_its_bifurcation(stickslip, fit, family, tmp_path):
    answer = stickslip("compare", fit, family, "--no-uncertainty", "--figure", "family.svg", "--json")
    assert answer.code == 0, answer.err
    content = answer.json
    (found,) = content["families"]
    assert content["passed"] and found["varied"] == "disc0"
    assert [one["measured"]["motion"] for one in found["comparisons"][:3]] == ["stick on disc0"] * 3
    assert "steady sliding" in found["comparisons"][3]["measured"]["motion"]
    (bifurcation,) = found["bifurcations"]
    assert bifurcation["predicted"]["speed"] == pytest.approx(2.3823, rel=5e-3)
    assert bifurcation["measured"]["low"] == pytest.approx(2.2, rel=5e-3)
    assert bifurcation["measured"]["high"] == pytest.approx(2.8, rel=5e-3)
    assert bifurcation["measured"]["estimate"] == pytest.approx(2.3823, rel=0.02)
    assert found["hopf_speed"] == pytest.approx(1.671, rel=5e-3)
    assert (tmp_path / "family.svg").read_text().rstrip().endswith("</svg>")


def test_a_wrong_fit_predicts_the_end_of_stick_slip_elsewhere(stickslip, fit, family, tmp_path):
    plain = json.loads(fit.read_text())
    for parameter in plain["parameters"]:
        if parameter["name"] == "mu_k":
            parameter["value"] *= 0.8
    (tmp_path / "wrong.json").write_text(json.dumps(plain))
    answer = stickslip("compare", "wrong.json", family, "--no-uncertainty", "--json")
    assert answer.code == 0
    (bifurcation,) = answer.json["families"][0]["bifurcations"]
    assert bifurcation["predicted"]["speed"] > 2.9 and bifurcation["passed"] is False
    assert not answer.json["passed"]


def test_a_report_holds_everything_and_replaces_nothing(stickslip, fit, tmp_path):
    answer = stickslip("report", fit, RIGS, "-o", "all.html", "--no-uncertainty", "--json")
    assert answer.code == 0, answer.err
    page = (tmp_path / "all.html").read_text("utf-8")
    assert answer.json["bytes"] == len(page.encode())
    assert page.count("<svg") == 5  # portrait and law first; friction, residuals, family
    for said in ("gave the same values", "would help most", "paper-rubber-0.83"):
        assert said in page
    package = json.loads((RIGS / "datapackage.json").read_text())
    for resource in package["resources"]:
        assert resource["hash"].removeprefix("sha256:") in page
    again = stickslip("report", fit, RIGS, "-o", "all.html")
    assert again.code == 2 and "exists already" in again.err


@pytest.mark.nightly
def test_logs_that_were_not_fitted_are_compared_and_said_so(stickslip, fit, family, tmp_path):
    answer = stickslip("report", fit, family, "--no-uncertainty", "--interactive")
    assert answer.code == 0, answer.err
    page = (tmp_path / "report.html").read_text("utf-8")
    assert "Not among the logs given, though fitted: paper-rubber-0.41" in page
    # portrait and law first; friction and family: residuals need the logs of the fit
    assert "compared only" in page and page.count("<svg") == 4 and page.count("<iframe sandbox=") == 1


@pytest.mark.nightly
def test_fitted_values_go_into_an_fmu_a_scene_and_an_ssp(stickslip, fit, tmp_path):
    values = {q["name"]: q["value"] for q in json.loads(fit.read_text())["parameters"]}
    assert stickslip("apply", fit, "-o", "rig.fmu").code == 0
    starts = {v.name: v.start for v in fmpy.read_model_description(tmp_path / "rig.fmu").modelVariables}
    assert {name: float(str(starts[f"{name}0"])) for name in values} == values
    copied = stickslip("apply", fit, "rig.fmu", "-o", "again.fmu", "--only", "mu_s0", "--json")
    assert copied.json["values"]["mu_s0"]["value"] == values["mu_s"]
    one, two = (simulate(Fmu.open(tmp_path / name), 3.0) for name in ("rig.fmu", "again.fmu"))
    assert (one["theta"] == two["theta"]).all()
    made = stickslip("apply", fit, SCENE, "-o", "scene.toml")
    assert made.code == 0 and "[[reference]]" in made.out
    assert f"mu_s0 = {values['mu_s']!r}" in (tmp_path / "scene.toml").read_text()
    assert stickslip("apply", fit, "-o", "rig.ssp").code == 0
    assert set(zipfile.ZipFile(tmp_path / "rig.ssp").namelist()) == {
        *("SystemStructure.ssd", "fitted.ssv", "resources/disc_rig.fmu")
    }
    coupled = stickslip("couple", "rig.ssp", "--until", 2, "--json")
    assert coupled.code == 0, coupled.err
    expected = simulate(Fmu.open(tmp_path / "rig.fmu"), 2.0)["theta"][-1]
    assert coupled.json["variables"]["rig.theta"]["last"] == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["apply", "FIT"], "Say what to write"),
        (["apply", "FIT", "-o", "x.txt"], "of no kind that takes parameters"),
        (["apply", "FIT", "-o", "x.toml"], "Which scene"),
        (["apply", "FIT", SCENE, "-o", "x.fmu"], "of another"),
        (["apply", "FIT", SCENE, "-o", "x.ssv"], "written anew"),
        (["apply", "FIT", SCENE, "-o", "x.toml", "--only", "mu_x0"], "hands on no 'mu_x0'"),
        (["apply", "FIT", SCENE, "-o", "x.toml", "--name", "mu_s0=mu"], "has no parameter 'mu'"),
        (["apply", "FIT", "-o", "x.ssv", "--name", "mu_s0"], "NAME=ITS_NAME"),
        (["apply", "missing.json", "-o", "x.ssv"], "missing.json"),
        (["report", "FIT", RIGS, "-o", "x.pdf"], "end it in .html"),
        (["compare", "FIT", RIGS, "--figure", "x.bmp"], "x.bmp"),
        (["compare", "FIT", RIGS, "--set", "J=0.06"], "Compare like with like"),
    ],
)
def test_bad_input_is_refused_with_a_reason_and_leaves_nothing(stickslip, fit, tmp_path, arguments, said):
    answer = stickslip(*(fit if word == "FIT" else word for word in arguments))
    assert answer.code == 2
    assert said in " ".join(answer.err.split())
    assert not list(tmp_path.iterdir())


def test_an_interrupted_fit_keeps_what_is_finished(stickslip, monkeypatch, tmp_path):
    """Ctrl-C while the figure is drawn: the numbers are there, and it is said."""

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(commands, "draw_friction", interrupted)
    answer = stickslip("fit", RIGS, "--estimator", "weak-form", "--result", "fit.json", "--figure", "friction.png")
    assert answer.code == 130
    assert "what was finished is kept" in answer.err and "written: fit.json" in answer.out
    assert [path.name for path in tmp_path.iterdir()] == ["fit.json"]
    assert json.loads((tmp_path / "fit.json").read_text())["law"] == "Conti"


@pytest.mark.nightly
def test_a_fit_interrupted_on_its_way_to_intervals_says_what_it_is(stickslip, monkeypatch, tmp_path):
    from identification.inference import choice as inference

    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(inference, "profile", interrupted)
    asked = ("fit", RIGS, "--estimator", "weak-form", "--profile", "--result", "fit.json", "--figure", "friction.png")
    answer = stickslip(*asked)
    assert answer.code == 130, answer.err
    kept = json.loads((tmp_path / "fit.json").read_text())
    assert any(warning.startswith("Interrupted") for warning in kept["warnings"]) and kept["intervals"] == []
    assert [path.name for path in tmp_path.iterdir()] == ["fit.json"]
