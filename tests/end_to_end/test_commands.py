"""The command line as a user meets it: results and JSON."""

from __future__ import annotations

import os
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
