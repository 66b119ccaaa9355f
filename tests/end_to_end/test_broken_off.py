"""Commands that cannot come to their end: full disks, interrupts, damaged caches, killed processes. One line each."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

from fmu_models.base import temporary
from fmu_models.base.errors import WriteError
from fmu_models.base.files import write_whole
from fmu_models.codegen.package import built, export
from fmu_models.fmu.fmu import Fmu
from fmu_models.report.manual import NEEDED
from fmu_models.simulation.results import write_trajectory
from fmu_models.simulation.run import simulate

pytestmark = pytest.mark.skipif(os.name != "posix", reason="limits of files, /dev/full and signals as POSIX has them")
CALL = "from identification.cli import main; main()"


def command(*arguments: str, folder: Path, stdout: int | None = subprocess.PIPE, largest: int | None = None, call=CALL):
    """The command in a process of its own, which can write no file larger than so many bytes."""

    def limit() -> None:
        if largest is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))

    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2]), "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run(
        [sys.executable, "-c", call, *arguments],
        cwd=folder,
        env=environment,
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=limit,
        check=False,
    )


def assert_one_line(done: subprocess.CompletedProcess[str], code: int) -> None:
    assert done.returncode == code, done.stderr
    assert done.stderr.startswith("stickslip: ") and len(done.stderr.splitlines()) == 1, done.stderr


@pytest.mark.parametrize(
    ("what", "largest"),
    [
        ("export bouncing_ball", 20000),
        ("simulate bouncing_ball", 20000),  # its library cannot be unpacked
        ("simulate bouncing_ball --samples 20001 --figure x.svg", 200000),
        ("simulate bouncing_ball --samples 20001 --output x.csv", 200000),
        ("simulate bouncing_ball --samples 20001 --output x.h5", 200000),
    ],
)
def test_a_disk_that_takes_no_more(what: str, largest: int, tmp_path: Path) -> None:
    built("bouncing_ball")
    assert_one_line(command(*what.split(), folder=tmp_path, largest=largest), 74)
    assert not list(tmp_path.iterdir())


def test_a_disk_of_the_cache_that_takes_no_more(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path / "cache"))
    # the sources of the engine are what is written first
    done = command("export", "bouncing_ball", folder=tmp_path, largest=5000)
    assert_one_line(done, 74)
    assert f"The disk of the cache folder '{tmp_path / 'cache'}' is full" in done.stderr
    assert not list(tmp_path.glob("*.fmu")) and not list((tmp_path / "cache").rglob("*.fmu"))


def test_output_that_goes_nowhere(tmp_path: Path) -> None:
    with Path("/dev/full").open("w") as full:
        done = command("models", folder=tmp_path, stdout=full.fileno())
    assert_one_line(done, 74)


def test_a_trajectory_that_does_not_fit(tmp_path: Path) -> None:
    run = simulate(Fmu.open(built("bouncing_ball")), 1.0)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    for suffix in ("csv", "h5"):
        resource.setrlimit(resource.RLIMIT_FSIZE, (10000, hard))
        try:
            with pytest.raises(WriteError, match="cannot be written"):
                write_trajectory(run, tmp_path / f"run.{suffix}")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert not list(tmp_path.iterdir())
    write_trajectory(run, tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5") as file:
        time = file["time"]
        assert isinstance(time, h5py.Dataset) and np.array_equal(time[:], run.time)


@pytest.mark.parametrize(
    ("module", "asked"),
    [("typer", "models"), ("fmu_models.commands.models", "models"), ("rig_io.commands.emulate", "emulate")],
)
def test_an_interrupt_while_the_command_is_imported(module: str, asked: str, tmp_path: Path) -> None:
    """It comes as this module is about to be imported."""
    interrupting = (
        "import os, signal, sys\n"
        "class Interrupting:\n"
        "    def find_spec(self, name, *_):\n"
        f"        if name == {module!r}: os.kill(os.getpid(), signal.SIGINT)\n"
        "from identification.cli import main\n"
        "sys.meta_path.insert(0, Interrupting())\n"
        "main()\n"
    )
    assert_one_line(command(asked, folder=tmp_path, call=interrupting), 130)


@pytest.mark.parametrize("damage", [lambda data: data[:5000], lambda data: data[:900] + b"\0\0\0" + data[903:]])
def test_a_damaged_file_of_the_cache_is_built_again(damage, tmp_path: Path) -> None:
    kept = built("bouncing_ball")
    whole = kept.read_bytes()
    kept.write_bytes(damage(whole))
    try:
        assert export("bouncing_ball", tmp_path / "ball.fmu").read_bytes() == whole
    finally:
        kept.write_bytes(whole)


def test_what_a_killed_process_was_writing_goes_with_the_next_file_written_there(tmp_path: Path) -> None:
    code = (
        "import os, signal, sys; from fmu_models.base.files import write_whole\n"
        "with write_whole(sys.argv[1]) as path:\n"
        "    path.write_text('half'); os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    assert command(str(tmp_path / "run.csv"), folder=tmp_path, call=code).returncode == -signal.SIGKILL
    assert len(list(tmp_path.rglob("run.csv"))) == 1
    with write_whole(tmp_path / "other.csv") as path:
        path.write_text("whole")
    assert [file.name for file in tmp_path.iterdir()] == ["other.csv"]


def test_folders_of_killed_processes_go_at_the_next_start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    code = (
        "import os, signal; from fmu_models.base.temporary import claim_folder\n"
        "print(claim_folder('master'), flush=True); os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2]), "TMPDIR": str(tmp_path)}
    killed = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert killed.returncode == -signal.SIGKILL
    left = Path(killed.stdout.strip())
    assert left.is_dir() and left.is_relative_to(tmp_path)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with temporary.temporary_folder("here") as mine:
        assert not left.parent.exists()
        # that of a process that lives stays, whoever comes
        monkeypatch.setattr(temporary, "_swept", set())
        with temporary.temporary_folder("there"):
            assert mine.is_dir()
    assert not list(tmp_path.iterdir())


@pytest.mark.nightly
def test_an_interrupted_demo_keeps_its_logs_and_says_so(tmp_path: Path) -> None:
    process = begun("demo", "look", folder=tmp_path)
    made = tmp_path / "look" / "logs" / "datapackage.json"
    appear(made, process)
    time.sleep(5)  # in the fit, which takes longer
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=120)[1]
    assert process.returncode == 130 and "interrupted; what was finished is kept" in said
    assert made.is_file() and not (tmp_path / "look" / "report.html").exists()


@pytest.mark.nightly
def test_an_interrupted_manual_leaves_no_sphinx_and_no_folder(tmp_path: Path) -> None:
    for module in NEEDED:
        pytest.importorskip(module)
    cache = tmp_path / "cache"
    process = begun("docs", "--build", "--no-open", folder=tmp_path, STICKSLIP_CACHE=str(cache))
    appear(cache, process)
    time.sleep(5)
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert process.returncode == 130 and children
    assert not any(Path(f"/proc/{child}").exists() for child in children)
    assert not list(cache.glob("*manual*"))


def begun(*arguments: str, folder: Path, **environment: str) -> subprocess.Popen[str]:
    room = {"PYTHONPATH": str(Path(__file__).parents[2]), **environment}
    line = [sys.executable, "-c", CALL, *arguments]
    return subprocess.Popen(line, cwd=folder, env=os.environ | room, stderr=subprocess.PIPE, text=True)


def appear(path: Path, process: subprocess.Popen[str]) -> None:
    """Wait for a file of a process."""
    end = time.monotonic() + 120
    while not path.exists():
        assert process.poll() is None and time.monotonic() < end
        time.sleep(0.1)
