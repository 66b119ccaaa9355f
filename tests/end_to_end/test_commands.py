"""The command line as a user meets it: results, JSON, and what bad input answers."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
import typer

from fmu_models.fmu.fmu import Fmu
from fmu_models.report import model_sheet
from fmu_models.simulation.run import simulate
from identification.commands import application
from rig_io.logs.log import RigLog
from rig_io.packages.datapackage import read_package
from rig_io.sensors import edges

RIGS = Path(__file__).parents[2] / "data" / "rigs" / "paper_rubber"


def files(folder: Path) -> set[str]:
    return {path.name for path in folder.rglob("*")}


def test_help_is_there_for_every_command_and_shows_an_example(stickslip):
    listed = stickslip("--help")
    assert listed.code == 0
    functions: list[Any] = application.whole().registered_commands
    names = {one.name or one.callback.__name__ for one in functions}
    groups: list[Any] = application.whole().registered_groups
    inner = {
        f"{group.name} {one.callback.__name__}" for group in groups for one in group.typer_instance.registered_commands
    }
    assert {"models", "simulate", "fit", "map", "new model"} <= names | inner
    for command in names | inner:
        assert command.partition(" ")[0] in listed.out
        assert f"Example: stickslip {command}" in stickslip(*command.split(), "--help").out


def test_a_switch_that_nothing_turns_off_is_off_unless_it_is_given():
    program: Any = typer.main.get_command(application.whole())
    commands = {**program.commands, **program.commands["new"].commands, **program.commands["data"].commands}
    flags = {
        (name, option.name): option.default
        for name, command in commands.items()
        for option in command.params
        if getattr(option, "is_flag", False) and not option.secondary_opts
    }
    assert len(flags) > 60 and {"json", "once", "overwrite"} <= {name for _, name in flags}
    assert not any(flags.values()), [flag for flag, default in flags.items() if default]


def test_paragraphs_of_help_are_broken_where_the_terminal_ends_and_nowhere_else():
    """Examples are broken by ourselves, between options: see test_narrow_terminal."""
    program: Any = typer.main.get_command(application.whole())
    helps = [one.help for one in [*program.commands.values(), *program.commands["new"].commands.values()]]
    texts = [text for one in helps for text in one.split("\n\n")[1:] if not text.startswith("Example:")]
    assert len(helps) > 30 and texts and not any("\n" in text for text in texts)


def test_the_installed_command_starts_without_heavy_imports(tmp_path):
    """Help, in a fresh interpreter: none of the libraries that take long to load; of a page that was printed before,
    not even those that print it."""

    def pages(*arguments: str, heavy: str, **environment: str) -> bytes:
        code = (
            f"import sys; sys.argv = ['stickslip', *{arguments}]\n"
            "from identification import cli\n"
            "try: cli.main()\n"
            "except SystemExit as end: assert not end.code\n"
            f"heavy = {{*'{heavy}'.split()}} & set(sys.modules)\n"
            "assert not heavy, heavy\n"
        )
        environment = {**os.environ, "STICKSLIP_CACHE": str(tmp_path), **environment}
        return subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.PIPE, env=environment).stdout

    libraries = "numpy scipy sympy matplotlib pandas fmpy pint"
    for arguments in (("--help",), ("models", "-h")):
        first = pages(*arguments, heavy=libraries)
        assert b"Usage: stickslip" in first
        assert pages(*arguments, heavy=f"{libraries} typer rich") == first
        narrow = pages(*arguments, heavy=libraries, COLUMNS="50")
        assert max(map(len, narrow.decode().splitlines())) <= 50 < max(map(len, first.decode().splitlines()))
    for page in (tmp_path / "help").glob("*.txt"):
        page.write_text("damaged")
    assert b"damaged" not in pages("--help", heavy=libraries)


def test_a_warm_run_imports_what_it_needs_alone(stickslip):
    stickslip("simulate", "block_on_belt", "--until", "1")
    code = (
        "import sys; sys.argv = 'stickslip simulate block_on_belt --until 1'.split()\n"
        "from identification import cli\n"
        "try: cli.main()\n"
        "except SystemExit as end: assert not end.code\n"
        "spared = 'scipy sympy matplotlib pandas fmpy pint h5py jinja2 importlib.metadata logging numpy.polynomial'\n"
        "assert not {*spared.split()} & set(sys.modules)\n"
    )
    assert b"contact belt" in subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.PIPE).stdout


def test_models_and_show(stickslip):
    names = [row["name"] for row in stickslip("models", "--json").json["models"]]
    assert {"disc_rig", "block_on_belt"} <= set(names)
    shown = stickslip("show", "disc_rig", "--contacts", "disc0", "--json").json
    assert [contact["name"] for contact in shown["contacts"]] == ["disc0"]
    assert {"J", "mu_s0"} <= {row["name"] for row in shown["parameters"]}
    assert "N0*mu_s0" in stickslip("show", "disc_rig").out


def test_a_sheet_is_derived_once(stickslip, monkeypatch, tmp_path):
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path / "cache"))
    whole, part = (("show", "bouncing_ball", *contacts, "--json") for contacts in ((), ("--contacts", "none")))
    derived = stickslip(*whole).out
    assert stickslip(*part).out != derived
    with monkeypatch.context() as patch:
        patch.delattr(model_sheet, "sheet")
        assert stickslip(*whole).out == derived
    for kept in (tmp_path / "cache").rglob("sheet.json"):
        kept.write_text("{}")
    assert stickslip(*whole).out == derived


def test_maps_and_map(stickslip):
    assert {"henon", "high_bounce"} <= {row["name"] for row in stickslip("maps", "--json").json["maps"]}
    told = stickslip("map", "henon", "--set", "a=1.2", "--period", "2", "--lyapunov", "--start", "x=0.2", "--json").json
    (motion,) = told["motions"]
    assert [point["x"] for point in motion["points"]] == pytest.approx([-0.4686786496, 1.0520119829], abs=1e-9)
    assert motion["classes"] == ["oscillatory, unstable", "oscillatory, stable"]
    assert sum(told["lyapunov"]["exponents"]) == pytest.approx(np.log(0.3))
    shown = stickslip("map", "henon", "--set", "a=1.2", "--period", "2").out
    assert "-0.4686786496" in shown
    assert "oscillatory, unstable" in shown


def test_map_tells_jumps_bifurcations_and_the_negative_map(stickslip):
    (jump,) = stickslip("map", "piecewise_linear", "--json").json["jumps"]
    assert jump["crosses_diagonal"]
    assert "no fixed point" in stickslip("map", "piecewise_linear").out
    (flip,) = stickslip("map", "logistic", "--set", "r=2.9", "--vary", "r=3.3", "--json").json["bifurcations"]
    assert (flip["kind"], flip["value"]) == ("flip", pytest.approx(3.0, abs=1e-12))
    assert "flip" in stickslip("map", "logistic", "--set", "r=2.9", "--vary", "r=3.3").out
    assert "neither a saddle-node nor a flip" in stickslip("map", "logistic", "--vary", "r=3.21").out
    assert "6.4124629" in stickslip("map", "henon", "--negative").out  # 1 over 0.15594632
    calm = stickslip("map", "logistic", "--set", "r=2", "--lyapunov")
    assert "Lyapunov exponents: -inf" in calm.out
    assert "none found" in stickslip("map", "henon", "--period", "3").out


def test_export_verifies_what_was_exported(stickslip, tmp_path):
    assert stickslip("export", "block_on_belt", "--set", "mu_s=0.9", "-o", "belt.fmu").code == 0
    done = stickslip("export", "--verify", "belt.fmu", "--json")
    assert done.code == 0 and done.json["differences"] == []
    with zipfile.ZipFile(tmp_path / "belt.fmu", "a") as archive:
        archive.writestr("resources/more.txt", "x")
    altered = stickslip("export", "--verify", "belt.fmu")
    assert altered.code == 2 and "resources/more.txt: not what the model gives" in altered.err
    assert files(tmp_path) == {"belt.fmu"}


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_export_gives_a_real_fmu_with_the_values_set(stickslip, tmp_path, version):
    done = stickslip("export", "disc_rig", "--contacts", "disc0", "--fmi", version, "--set", "N0=8", "-o", "rig.fmu")
    assert done.code == 0
    description = fmpy.read_model_description(tmp_path / "rig.fmu")
    assert description.fmiVersion == version
    assert {v.name: v.start for v in description.modelVariables}["N0"] == "8.0"
    asked = simulate(Fmu.open(tmp_path / "rig.fmu"), 3.0)
    default = stickslip("export", "disc_rig", "--contacts", "disc0", "--fmi", version)
    assert default.code == 0
    told = simulate(Fmu.open(tmp_path / "disc_rig_disc0.fmu"), 3.0, parameters={"N0": 8.0})
    assert np.array_equal(asked["theta"], told["theta"])


def test_simulate_tells_what_happened(stickslip, tmp_path):
    arguments = ("simulate", "disc_rig", "--contacts", "disc0", "--input", "w0=0.41", "--until", "10")
    told = stickslip(*arguments, "--output", "run.csv", "--figure", "run.svg", "--json")
    assert told.code == 0
    content = told.json
    assert content["contacts"]["disc0"]["events"] == 19
    assert content["ranges"]["theta"]["max"] == pytest.approx(0.173042955, rel=1e-5)
    header, first = (tmp_path / "run.csv").read_text().splitlines()[:2]
    assert header.startswith("time [s],w0 [rad/s],theta [rad]")
    assert first.startswith("0.0,0.41,")
    assert "<svg" in (tmp_path / "run.svg").read_text()
    assert content["contacts"]["disc0"]["shares"]["stick"] == pytest.approx(0.355, abs=0.01)
    assert "stick 35" in stickslip(*arguments).out


def test_the_whole_road(stickslip, tmp_path):
    """Emulate, fit, compare, export: the fitted law is the emulated one, and the portraits agree."""
    done = stickslip("demo", "road", "--json")
    assert done.code == 0
    content = done.json
    fitted = {q["name"]: q for q in content["fit"]["parameters"]}
    for name, truth, share in (("mu_s", 0.65, 0.01), ("mu_k", 0.35, 0.01), ("p", 15.0, 0.03)):
        assert fitted[name]["value"] == pytest.approx(truth, rel=share)
    assert all(one["passed"] for one in content["families"])
    for path in content["files"].values():
        assert (tmp_path / path).exists()
    starts = {v.name: v.start for v in fmpy.read_model_description(tmp_path / content["files"]["fmu"]).modelVariables}
    assert starts["mu_s0"] == repr(fitted["mu_s"]["value"])


def test_fit_and_compare_on_the_logs_that_come_along(stickslip, tmp_path):
    asked = ("--estimator", "weak-form", "--result", "fit.json", "--figure", "friction.png", "--json")
    fitted = stickslip("fit", RIGS, *asked)
    assert fitted.code == 0, fitted.err
    values = {q["name"]: q["value"] for q in fitted.json["parameters"]}
    assert values["mu_s"] == pytest.approx(0.65, rel=0.01)
    assert fitted.json["free_decay"]["k/J"]["value"] == pytest.approx(2.62 / 0.0548, rel=1e-4)
    assert fitted.json["free_decay"]["c/J"]["value"] == pytest.approx(0.055 / 0.0548, rel=1e-3)
    compared = stickslip("compare", "fit.json", RIGS, "--figure", "portraits.png")
    assert compared.code == 0, compared.err
    assert {"fit.json", "friction.png", "portraits.png"} <= files(tmp_path)
    assert "Stick on disc0 disappears: predicted at 2.38" in " ".join(compared.out.split())


@pytest.mark.nightly
def test_a_constant_set_without_uncertainty_is_not_taken_as_exact(stickslip):
    def fitted(*arguments):
        told = stickslip("fit", RIGS, "--estimator", "weak-form", *arguments, "--json")
        assert told.code == 0, told.err
        return told.json["parameters"][0]

    bare = fitted("--set", "N=4.905")
    assert bare["at_least"]
    # mu_s goes with 1/N; the rest of its deviation comes from J
    known = fitted("--set", "N=4.905±2%")
    # the derivative of the slips by N, which tells nothing of it, is zero to rounding of its differences
    assert not known["at_least"] and known["value"] == pytest.approx(bare["value"], rel=1e-8)
    assert known["sd_rig_constants"] == pytest.approx(
        np.hypot(bare["sd_rig_constants"], 0.02 * bare["value"]), rel=1e-3
    )
    assert fitted("--set", "N=4.905", "--uncertainty", "N=0.0981") == known


def unevenness(log: RigLog) -> float:
    """How far the drive is from an even turn, rad."""
    found = edges(log, "drive0")
    return float(np.max(np.abs(found.angle - np.polynomial.Polynomial.fit(found.time, found.angle, 1)(found.time))))


def test_emulated_logs_are_the_same_for_the_same_seed(stickslip, tmp_path):
    for folder in ("one", "two"):
        assert stickslip("emulate", folder, "--seed", 5, "--speeds", "0.83", "--duration", "4").code == 0
    for path in (tmp_path / "one").glob("*.csv"):
        assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes()
    # without a word the rig has all of its sensors, and a drive that is not quite even
    log = read_package(tmp_path / "one")[0]
    assert {"laser", "encoder_count", "drive0_count"} <= set(log.columns)
    assert unevenness(log) > 5e-4


def test_a_disturbance_of_the_bench_is_emulated_as_it_is_said(stickslip, tmp_path):
    settings = ("--seed", 5, "--speeds", "0.83", "--duration", "4", "--no-encoder", "--no-ripple")
    assert stickslip("emulate", "clean", *settings).code == 0
    assert stickslip("emulate", "drifting", *settings, "--disturbance", "drift=1.5mm").code == 0
    clean, drifting = (read_package(tmp_path / folder)[0] for folder in ("clean", "drifting"))
    gain = clean.calibration.need("laser").gain
    shown = gain * (drifting.column("laser") - clean.column("laser"))
    assert np.max(np.abs(shown)) == pytest.approx(1.5e-3, rel=0.01)  # readings are 10 um apart
    assert drifting.experiment.emulation["disturbances"]["drift"] == 1.5e-3
    assert unevenness(clean) < 3e-4  # that of the encoder's lines


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["show", "disc_rgi"], "Did you mean 'disc_rig'"),
        (["map", "henn"], "Did you mean 'henon'"),
        (["map", "henon", "--set", "c=1"], "henon has no parameter 'c'"),
        (["map", "henon", "--set", "b=0", "--negative"], "b = 0"),
        (["map", "piecewise_linear", "--set", "a=0.5"], "must exceed 1"),
        (["map", "henon", "--start", "x=1"], "Add --lyapunov"),
        (["map", "henon", "--lyapunov", "--start", "z=1"], "henon has no state 'z'"),
        (["map", "henon", "--lyapunov", "--start", "x=9"], "leaves every bound"),
        (["map", "logistic", "--negative"], "logistic has no inverse"),
        (["map", "logistic", "--vary", "r"], "NAME=VALUE"),
        (["map", "logistic", "--vary", "q=3"], "logistic has no parameter 'q'"),
        (["map", "logistic", "--set", "r=2", "--period", "2", "--vary", "r=4"], "no motion of period 2"),
        (["map", "logistic", "--period", "0"], "--period"),
        (["export", "disc_rig", "--contacts", "disk0"], "Did you mean 'disc0'"),
        (["export", "disc_rig", "--fmi", "1.0"], "There is no FMI 1.0"),
        (["export", "disc_rig", "-o", "rig.zip"], "must end in .fmu"),
        (["export", "disc_rig", "--set", "J=0"], "J"),
        (["export", "disc_rig", "--platform", "win65"], "There is no platform 'win65'. Did you mean 'win64'"),
        (["export", "disc_rig", "--fitted", "fitted.ssv"], "A parameter set is packed along with --ssp"),
        (["export", "disc_rig_motors", "--ssp", "--set", "J=1"], "is a system: its units say"),
        (["export", "disc_rig_motors", "--ssp", "-o", "x.zip"], "must end in .ssp"),
        (["export", "henon", "--contacts", "x"], "henon is a map: it has no contacts"),
        (["export", "henon", "--set", "period=0"], "period"),
        (["simulate", "disc_rig", "--set", "N0=-1"], "normal force of disc 0"),
        (["simulate", "disc_rig", "--set", "mu_k0=0.9"], "mu_k0 exceeds mu_s0"),
        (["simulate", "disc_rig", "--set", "mu_x0=0.9"], "Did you mean 'mu_s0'"),
        (["simulate", "disc_rig", "--set", "J=heavy"], "NAME=VALUE"),
        (["simulate", "disc_rig", "--set", "J=nan"], "finite"),
        (["simulate", "disc_rig", "--set", "J=1", "--set", "J=2"], "given twice"),
        (["simulate", "disc_rig", "--start", "thta=1"], "Did you mean 'theta'"),
        (["simulate", "disc_rig", "--input", "w2=1"], "has no input 'w2'"),
        (["simulate", "disc_rig", "--until", "-1"], "must end after it starts"),
        (["simulate", "missing.fmu"], "There is no file 'missing.fmu'"),
        (["simulate", "disc_rig", "--figure", "run.bmp"], "run.bmp"),
        (["emulate", "logs", "--material", "steel"], "no material 'steel'"),
        (["emulate", "logs", "--speeds", "fast"], "numbers separated by commas"),
        (["emulate", "logs", "--no-laser", "--no-encoder"], "no sensor sees the disc"),
        (["emulate", "logs", "--disturbance", "onze=5%"], "Did you mean 'once'"),
        (["emulate", "logs", "--disturbance", "drift=5%"], "Its unit is m."),
        (["emulate", "logs", "--disturbance", "once=80%"], "up to 0.5"),
        (["emulate", "logs", "--disturbance", "once=1%", "--second-disc", "0.3"], "with one disc"),
        (["fit", "nowhere"], "nowhere"),
        (["fit", RIGS, "--estimator", "guess"], "No estimator is called 'guess'"),
        (["fit", RIGS, "--law", "Cont"], "Did you mean 'Conti'"),
        (["fit", RIGS, "--set", "M=1"], "no constant 'M'"),
        (["fit", RIGS, "--uncertainty", "J=-1%"], "The uncertainty of J is -1"),
        (["fit", RIGS, "--uncertainty", "k/J=1%"], "An uncertainty of k/J needs its value"),
        (["fit", RIGS, "--set", "J=0.05+-1%", "--uncertainty", "J=1"], "'J' is given twice"),
        (["fit", RIGS / "free-decay.csv"], "no stick-slip log"),
        (["compare", "fit.json", RIGS], "fit.json"),
        (["demo", "."], "exists already"),
    ],
)
def test_bad_input_is_refused_with_a_reason_and_leaves_nothing(stickslip, tmp_path, arguments, said):
    answer = stickslip(*arguments)
    assert answer.code == 2
    assert said in answer.err
    assert "Traceback" not in answer.err
    assert not files(tmp_path)


def test_what_exists_stays(stickslip, tmp_path):
    for command, target in (
        (("export", "disc_rig", "-o", "kept.fmu"), "kept.fmu"),
        (("simulate", "disc_rig", "--output", "kept.csv"), "kept.csv"),
        (("simulate", "disc_rig", "--figure", "kept.png"), "kept.png"),
        (("fit", RIGS, "--result", "kept.json"), "kept.json"),
        (("emulate", "kept", "--speeds", "0.83"), "kept"),
    ):
        path = tmp_path / target
        if target == "kept":
            path.mkdir()
            path = path / "mine.txt"
        path.write_text("mine")
        answer = stickslip(*command)
        assert answer.code == 2
        assert "exists already" in answer.err or "kept" in answer.err
        assert path.read_text() == "mine"


def test_what_comes_along_is_not_copied_over_what_is_there(stickslip, tmp_path, monkeypatch):
    monkeypatch.setattr("fmu_models.report.manual.manual_site", None)  # refused before it is built
    copied = stickslip("data", "copy", "scenes/disc_rig_class_a", "-o", "mine", "--json")
    (path,) = copied.json["files"]
    (tmp_path / path).write_text("mine")
    refused = {("data", "copy", "scenes/disc_rig_class_a"): "exists already", ("docs",): "holds something"}
    for command, said in refused.items():
        answer = stickslip(*command, "-o", "mine")
        assert answer.code == 2 and said in answer.err
    assert (tmp_path / path).read_text() == "mine"


@pytest.mark.skipif(os.geteuid() == 0 if hasattr(os, "geteuid") else True, reason="root may write anywhere")
def test_a_folder_that_cannot_be_written(stickslip, tmp_path):
    locked = tmp_path / "locked"
    locked.mkdir(mode=0o500)
    answer = stickslip("export", "disc_rig", "-o", "locked/rig.fmu")
    assert (answer.code, "cannot be written" in answer.err) == (2, True)


def test_a_target_below_a_file_cannot_be_written(stickslip, tmp_path):
    (tmp_path / "file").write_text("")
    answer = stickslip("export", "disc_rig", "-o", "file/rig.fmu")
    assert answer.code == 2
    assert "cannot be written" in answer.err


def _spoil(text: str, fault: str) -> str:
    lines = text.splitlines()
    cells = lines[50].split(",")
    if fault == "empty":
        return ""
    if fault == "no laser, no encoder":
        return "\n".join(",".join([line.split(",")[0], *line.split(",")[4:]]) for line in lines)
    if fault == "no count":
        lines[50] = ",".join([*cells[:2], "nan", *cells[3:]])
    if fault == "unsorted":
        lines[50], lines[60] = lines[60], lines[50]
    if fault == "duplicate":
        lines[51] = lines[50]
    if fault == "short":
        lines = lines[:300]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ("empty", "empty"),
        ("no laser, no encoder", "encoder"),
        ("no count", "encoder_count"),
        ("unsorted", "line"),
        ("duplicate", "line"),
        ("short", "cycle"),
    ],
)
def test_spoilt_logs_are_refused(stickslip, tmp_path, fault, said):
    shutil.copytree(RIGS, tmp_path / "logs")
    log = tmp_path / "logs" / "paper-rubber-0.83.csv"
    log.write_text(_spoil(log.read_text(), fault))
    sidecar = tmp_path / "logs" / "datapackage.json"
    package = json.loads(sidecar.read_text())
    for resource in package["resources"]:
        resource.pop("hash", None)
        resource.pop("bytes", None)
    sidecar.write_text(json.dumps(package))
    answer = stickslip("fit", tmp_path / "logs" / "paper-rubber-0.83.csv")
    assert answer.code == 2
    assert said in answer.err


GAINING = {"phi_S": -0.23692, "phi_M": 0.022625, "v": 0.377643, "w_M": 0.168194, "w_S": -2.417046}


def test_simulate_says_which_impacts_raised_the_energy(stickslip):
    start = [part for name, value in GAINING.items() for part in ("--start", f"{name}={value}")]
    run = ("simulate", "woodpecker", "--until", "0.05", *start)
    gaining = stickslip(*run, "--set", "eN1=0.9", "--json").json["impacts"]
    assert gaining["raised_energy"] == 1
    assert gaining["raised_by"] == gaining["largest_raise"] == pytest.approx(8.80e-6, rel=1e-2)
    assert gaining["work"] < gaining["largest_raise"]
    said = " ".join(stickslip(*run, "--set", "eN1=0.9").out.split())
    assert f"1 of {gaining['count']} impacts raised the energy (largest 8.8e-06 J): Newton's restitution" in said
    losing = stickslip(*run, "--json").json
    assert losing["impacts"]["raised_energy"] == 0 and losing["impacts"]["work"] < 0
    assert "raised the energy" not in stickslip(*run).out
    assert "open" in losing["contacts"]["beak"]["shares"] and "away" in losing["contacts"]["beak_friction"]["shares"]
    assert "impacts" not in stickslip("simulate", "block_on_belt", "--until", "1", "--json").json


@pytest.mark.parametrize("what", ["models", "maps"])
def test_a_list_is_kept_and_then_imports_no_member(stickslip, what):
    first = stickslip(what, "--json").out
    code = (
        "import sys; from identification.cli import main\n"
        "try: main()\n"
        "finally: assert 'sympy' not in sys.modules and 'numpy' not in sys.modules"
    )
    again = subprocess.run([sys.executable, "-c", code, what, "--json"], capture_output=True, text=True, check=False)
    assert (again.returncode, again.stderr, again.stdout) == (0, "", first)
