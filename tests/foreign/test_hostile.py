"""FMUs that do harm once they run: each is one failed run with its reason, and the next run is none the worse."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from build import build
from hostile_models import DESCRIPTION, FOLDER, NAMES, hostile

from fmu_models.base.child_process import IsolatedFailure, Limits
from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.experiment import FmuExperiment, perform

REASONS = {
    "crash": r"crashed \(SIGSEGV, segmentation fault\)",
    "eater": "more than the 400 MB",
    "hang": "did not end within 3 s",
    "not_a_number": "x|not a number|not finite",
    "quitter": "ended the process of the run",
    "failing": "fmi2GetDerivatives|error",
}
# those that return to the caller need no process of their own
POLITE = ("failing", "not_a_number")

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="signals and limits of memory")


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("hostile")
    for name in NAMES:
        hostile(name, made)
    return made


def stickslip(*arguments: object) -> subprocess.CompletedProcess[str]:
    call = "from identification.cli import main; main()"
    command = [sys.executable, "-c", call, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_every_one_has_its_reason() -> None:
    assert set(REASONS) == set(NAMES)


@pytest.mark.nightly_for("hang", "crash")
@pytest.mark.parametrize("name", NAMES)
def test_a_process_of_its_own_survives(folder: Path, name: str) -> None:
    fmu = Fmu.open(folder / f"{name}.fmu")
    assert fmu.problems == []
    # what ends by itself has all the time that a busy machine may need
    with pytest.raises(StickslipError, match=REASONS[name]) as caught:
        perform(fmu, FmuExperiment(2.0), limits=Limits(3 if name == "hang" else 100, 400))
    assert isinstance(caught.value, IsolatedFailure) == (name not in POLITE)
    good = Fmu.open(built("block_on_belt"))
    assert perform(good, FmuExperiment(1.0), limits=Limits(60, 400)).trajectory.time[-1] == 1.0


@pytest.mark.parametrize("name", POLITE)
def test_no_process_of_its_own_is_needed(folder: Path, name: str) -> None:
    with pytest.raises(StickslipError, match=REASONS[name]):
        perform(Fmu.open(folder / f"{name}.fmu"), FmuExperiment(2.0))


# the eater eats from the beginning
@pytest.mark.parametrize("name", sorted({*NAMES} - {"eater"}))
def test_before_the_harm_is_done_the_run_is_a_run(folder: Path, name: str) -> None:
    recording = perform(Fmu.open(folder / f"{name}.fmu"), FmuExperiment(0.5, start={"x": 1.0}), limits=Limits(60, 400))
    end = 1.5 if name != "not_a_number" else 1.0 + (1 - 0.5**1.5) / 1.5
    assert recording.trajectory["x"][-1] == pytest.approx(end, rel=1e-6)
    assert recording.provenance
    assert recording.provenance.model == name


@pytest.mark.nightly_for("hang", "crash", "eater", "not_a_number", "quitter")
@pytest.mark.parametrize("name", NAMES)
def test_the_command(folder: Path, tmp_path: Path, name: str) -> None:
    limits = ("--isolate", "--time-limit", 3 if name == "hang" else 100, "--memory-limit", "400")
    done = stickslip("simulate", folder / f"{name}.fmu", *limits, "-o", tmp_path / "run.h5", "--json")
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
    with pytest.raises(StickslipError, match=REASONS[name]):
        raise StickslipError(done.stderr)
    assert not list(tmp_path.iterdir())


@pytest.mark.nightly_for("crash", "failing", "quitter")
@pytest.mark.parametrize("name", NAMES)
def test_looking_at_one_is_safe(folder: Path, name: str) -> None:
    content = json.loads(stickslip("inspect", folder / f"{name}.fmu", "--json").stdout)
    assert (content["model"], content["runs_here"], content["states"]) == (name, True, ["x"])


@pytest.mark.parametrize("isolate", [(), ("--isolate",)])
def test_what_an_fmu_prints_does_not_end_up_in_the_result(tmp_path: Path, isolate: tuple[str, ...]) -> None:
    shutil.copy(FOLDER / "model_exchange.h", tmp_path)
    (tmp_path / "printer.c").write_text(
        '#include <stdio.h>\n#include "model_exchange.h"\n'
        'static fmi2Status derivative(Model *m) { printf("hello at %g\\n", m->time); return fmi2OK; }\n'
    )
    path = build(tmp_path / "printer.fmu", tmp_path / "printer.c", DESCRIPTION.replace("NAME", "printer"), "printer")
    done = stickslip("simulate", path, "--json", *isolate)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["ranges"]["x"]["end"] == pytest.approx(2.0)
    assert "hello at 0" in done.stderr


def test_an_output_that_is_not_a_number_is_told(tmp_path: Path) -> None:
    shutil.copy(FOLDER / "model_exchange.h", tmp_path)
    source = tmp_path / "gap.c"
    source.write_text('#include "model_exchange.h"\nstatic fmi2Status derivative(Model *m) { return fmi2OK; }\n')
    # the output of value reference 2 is 0/0 once t passes 1
    header = tmp_path / "model_exchange.h"
    text = header.read_text()
    header.write_text(
        text.replace("v[i] == 0 ? m->x", "v[i] == 2 ? (m->time > 1 ? m->x / 0.0 - m->x / 0.0 : 1) : v[i] == 0 ? m->x")
    )
    variable = '<ScalarVariable name="y" valueReference="2" causality="output"><Real/></ScalarVariable>'
    xml = DESCRIPTION.replace("NAME", "gap").replace("</ModelVariables>", f"{variable}</ModelVariables>")
    path = build(tmp_path / "gap.fmu", source, xml, "gap")
    done = stickslip("simulate", path, "--json", "--samples", 5)
    assert done.returncode == 0, done.stderr
    content = json.loads(done.stdout)
    assert content["not_finite"] == {"y": 1.5}
    assert content["ranges"]["y"] == {"unit": "1", "min": None, "max": None, "end": None}
    assert "'y' is not a finite number from t = 1.5 s" in done.stderr


def maps(number: str) -> str:
    """What a process has loaded; nothing if it is gone."""
    try:
        return Path(f"/proc/{number}/maps").read_text()
    except OSError:
        return ""


def test_an_interrupt_ends_a_hanging_run_and_leaves_nothing(folder: Path, tmp_path: Path) -> None:
    call = "from identification.cli import main; main()"
    command = [sys.executable, "-c", call, "simulate", str(folder / "hang.fmu"), "--isolate", "-o", "run.h5"]
    environment = {**os.environ, "TMPDIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)}
    parent = subprocess.Popen(command, env=environment, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    children = Path(f"/proc/{parent.pid}/task/{parent.pid}/children")
    try:
        numbers: list[str] = []
        # it hangs once it has loaded the FMU and the master, whose folder goes as soon as it is loaded
        while not any("hang.so" in (loaded := maps(number)) and "/master.so (deleted)" in loaded for number in numbers):
            assert parent.poll() is None
            time.sleep(0.05)
            numbers = children.read_text().split()
        while list(tmp_path.glob(".stickslip-master-*")):
            time.sleep(0.05)
        parent.send_signal(signal.SIGINT)
        _, said = parent.communicate(timeout=120)
    finally:
        parent.kill()  # its child goes with it
        parent.wait()
    assert parent.returncode == 130
    assert "interrupted" in said
    assert not any(Path(f"/proc/{number}").exists() for number in numbers)
    assert not list(tmp_path.iterdir())
