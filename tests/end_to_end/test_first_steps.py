"""What a newcomer tries first: help, version, completion, a wrong path, a file that is there already."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import fmu_models
from fmu_models.analyses.declaration import ANALYSES
from identification.commands import application

COMMANDS = sorted({*application.COMMANDS, *ANALYSES.names()} - {*application.GROUPS})

# command lines with a path that does not exist; what stands before it exists
MISSING = (
    *("fit absent.csv", "fit absent", "fit absent.json", "fit absent.csv --set J=1", "laws absent.csv", "laws absent"),
    *("compare absent.json logs", "report absent.json logs", "apply absent.json -o x.fmu", "design absent.json"),
    *("inspect absent.fmu", "simulate absent.fmu", "simulate absent.fmu --isolate", "simulate absent.toml"),
    *("export absent.toml", "scene absent.toml", "bench absent.toml", "emulate absent.toml"),
    *("couple absent.toml", "couple absent.ssp", "inverse absent.toml log.csv", "inverse emps absent.mat"),
    *("slips absent.toml log.csv", "slips lyon_stick_slip absent.mat --set stiffness=168 --set speed=42e-6"),
)


@pytest.mark.parametrize("command", COMMANDS)
def test_h_is_help(stickslip, command):
    assert stickslip(command, "-h").out == stickslip(command, "--help").out != ""


def test_the_version_is_that_of_the_package(stickslip):
    answer = stickslip("--version")
    assert (answer.code, answer.out) == (0, f"stickslip {fmu_models.__version__}\n")


def test_a_shell_completes_commands():
    """As bash asks: by variables of the environment."""
    asked = {"COMP_WORDS": "stickslip sim", "COMP_CWORD": "1", "_STICKSLIP_COMPLETE": "complete_bash"}
    code = "import sys; sys.argv = ['stickslip']; from identification import cli; cli.main()"
    run = subprocess.run([sys.executable, "-c", code], env={**os.environ, **asked}, capture_output=True, text=True)
    assert run.stdout.split() == ["simulate"]


@pytest.mark.parametrize("line", MISSING)
def test_a_path_that_does_not_exist_is_said_not_to_exist(stickslip, line):
    answer = stickslip(*shlex.split(line))
    assert answer.code == 2 and answer.out == ""
    assert answer.err.startswith("stickslip: There is no ") and "'absent" in answer.err
    assert list(Path.cwd().iterdir()) == []


def test_logs_that_come_along_are_said_to_be_had(stickslip):
    answer = stickslip("fit", "data/rigs/paper_rubber")
    assert answer.code == 2 and answer.err.rstrip().endswith("stickslip data copy rigs/paper_rubber")


def test_a_file_that_is_there_is_kept_and_the_way_to_replace_it_named(stickslip):
    Path("run.csv").write_text("mine")
    line = ("simulate", "block_on_belt", "--until", "1", "-o", "run.csv")
    answer = stickslip(*line)
    assert answer.code == 2 and "--overwrite" in answer.err and Path("run.csv").read_text() == "mine"
    assert stickslip(*line, "--overwrite").code == 0
    assert Path("run.csv").read_text().startswith("time [s]")
