"""A watched bench: it wears, loses a sensor, its drive slips; half-written files, restarts, a folder that goes."""

from __future__ import annotations

import json
import os
import select
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rig_io.bench.emulation import Disc, Emulation
from rig_io.bench.emulator import emulate, free_decay
from rig_io.bench.materials import Material
from rig_io.logs.log import RigLog

KNOWN = ["J=0.0548±0.0003", "R=0.125±0.00005", "r=0.06±0.00005", "N0=4.905±0.005"]
INSTRUMENTS = ["laser=0.01±0.00002 m/V, 5 V", "encoder=1000", "drive0=1000"]


Change = Callable[[dict[str, np.ndarray]], None]


def written(folder: Path, name: str, log: RigLog, day: int, change: Change | None = None) -> Path:
    """A log as a plain table, dated by the day on which it was recorded."""
    names = ("laser", "encoder_count", "drive0_count")
    columns = {"time": log.time, **{n: log.columns[n].copy() for n in names if n in log.columns}}
    if change is not None:
        change(columns)
    path = folder / name
    lines = [",".join(f"{n} [{u}]" for n, u in zip(columns, ("s", "V", "1", "1"), strict=False))]
    lines += [",".join(f"{v:.9g}" for v in row) for row in zip(*columns.values(), strict=True)]
    path.write_text("\n".join(lines) + "\n")
    at = 1_760_000_000 + 86400 * day
    os.utime(path, (at, at))
    return path


def run(number: int, friction: float = 1.0) -> RigLog:
    pair = Material("paper/rubber", {"mu_s": 0.65 * friction, "mu_k": 0.35 * friction, "p": 15.0})
    return emulate(Emulation(f"run-{number}", discs=(Disc(pair, 0.83),), duration=6.0), 5, number)


@pytest.fixture
def bench(stickslip, tmp_path: Path) -> Path:
    """A folder with a free decay and a first run, described."""
    folder = tmp_path / "bench"
    folder.mkdir()
    written(folder, "decay.csv", emulate(free_decay(duration=6.0), 5, 99), 0)
    written(folder, "run-0.csv", run(0), 0)
    sets = [part for said in (*KNOWN, *INSTRUMENTS) for part in ("--set", said)]
    told = stickslip("describe", folder, "--confirm", *sets, "--json")
    assert told.json["complete"], told.out
    return folder


def silent(column: str) -> Change:
    def change(columns: dict[str, np.ndarray]) -> None:
        columns[column][:] = 7.0

    return change


def slipping(log: RigLog) -> Change:
    """The shaft with the drive's encoder turns by 4 % more than the driving disc on it."""
    edges, first = np.unique(log.columns["drive0_edge_time"], return_index=True)
    turned = np.interp(log.time, edges, log.columns["drive0_count"][first])

    def change(columns: dict[str, np.ndarray]) -> None:
        columns["drive0_count"][:] = np.floor(1.04 * turned)

    return change


def test_wear_a_lost_sensor_and_a_slipping_drive_are_called(stickslip, bench: Path) -> None:
    for number in range(1, 5):
        written(bench, f"run-{number}.csv", run(number), number)
    for number in range(5, 7):
        written(bench, f"run-{number}.csv", run(number, 1 - 0.06 * (number - 4)), number)
    written(bench, "run-7.csv", run(7), 7, silent("encoder_count"))
    written(bench, "run-8.csv", run(8), 8, slipping(run(8)))
    page = bench.parent / "page.html"
    told = stickslip("watch", bench, "--once", "--json", "--page", page, "--estimator", "weak-form")
    assert told.code == 0, told.err
    entries = {one["name"]: one for one in told.json["entries"]}
    assert entries["decay.csv"]["status"] == "free-decay"
    assert all(entries[f"run-{i}.csv"]["status"] == "fitted" for i in range(7))
    assert all(not entries[f"run-{i}.csv"]["calls"] for i in range(5))
    assert any(call.startswith("wear: mu_s") for call in entries["run-6.csv"]["calls"]), entries["run-6.csv"]
    assert "lost sensor: 'encoder_count' shows nothing" in entries["run-7.csv"]["calls"]
    assert any(call.startswith("the drive slips") for call in entries["run-8.csv"]["calls"]), entries["run-8.csv"]
    mu_s, sd = entries["run-0.csv"]["values"]["mu_s"]
    assert abs(mu_s - 0.65) < 4 * sd
    text = page.read_text()
    assert "<svg" in text and "location.reload(), 1000 * 2" in text and "the drive slips" in text


def test_nothing_is_fitted_twice(stickslip, bench: Path, monkeypatch) -> None:
    first = stickslip("watch", bench, "--once", "--json", "--estimator", "weak-form").json
    shutil.copy(bench / "run-0.csv", bench / "copy.csv")
    import identification.watch.logs as logs

    def never(*_: object, **__: object) -> None:
        raise AssertionError("fitted again")

    monkeypatch.setattr(logs, "fit_friction", never)
    again = stickslip("watch", bench, "--once", "--json").json
    by_name = {one["name"]: one for one in again["entries"]}
    assert by_name["run-0.csv"] == next(one for one in first["entries"] if one["name"] == "run-0.csv")
    # in stick the disc follows its drive
    assert by_name["run-0.csv"]["values"]["stick ratio"][0] == pytest.approx(1, abs=0.01)
    assert by_name["copy.csv"]["status"] == "refused" and "the same data" in by_name["copy.csv"]["reason"]
    refused = stickslip("watch", bench, "--once", "--law", "Tustin")
    assert refused.code == 2 and "--state FILE" in refused.err


def test_what_cannot_be_watched_is_named(stickslip, tmp_path: Path) -> None:
    assert "no folder of logs" in stickslip("watch", tmp_path / "none", "--once").err
    (tmp_path / "empty").mkdir()
    written(tmp_path / "empty", "a.csv", run(1), 0)
    told = stickslip("watch", tmp_path / "empty", "--once")
    assert told.code == 0 and "Describe the first" in " ".join(told.out.split())
    assert "end it in .html" in stickslip("watch", tmp_path / "empty", "--once", "--page", "x.txt").err


@pytest.mark.nightly
@pytest.mark.skipif(sys.platform == "win32", reason="signals are of POSIX")
def test_half_written_files_restarts_and_a_removed_folder(bench: Path) -> None:
    state = bench.parent / "state.json"
    command = [sys.executable, "-c", "from identification.cli import main; main()", "watch", str(bench), "--json"]
    command += ["--state", str(state), "--interval", "0.2", "--rest", "1.5", "--estimator", "weak-form"]

    def begun() -> subprocess.Popen[str]:
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def names() -> dict[str, str]:
        if not state.exists():
            return {}
        return {one["name"]: one["status"] for one in json.loads(state.read_text())["entries"]}

    def waited(what: Callable[[], bool], seconds: float = 90.0) -> None:
        end = time.monotonic() + seconds
        while not what():
            assert time.monotonic() < end, (names(), process.poll())
            time.sleep(0.1)

    process = begun()
    try:
        waited(lambda: {"decay.csv", "run-0.csv"} <= set(names()))
        text = written(bench.parent, "later.csv", run(1), 1).read_text()
        with open(bench / "run-1.csv", "w") as file:
            for part in range(6):
                file.write(text[part * len(text) // 6 : (part + 1) * len(text) // 6])
                file.flush()
                time.sleep(0.5)
                assert "run-1.csv" not in names(), "it was still being written"
        waited(lambda: names().get("run-1.csv") == "fitted")
        time.sleep(2.0)  # its line is printed after its state is kept
        process.send_signal(signal.SIGINT)
        printed, _ = process.communicate(timeout=60)
        assert (
            process.returncode == 0
            and [json.loads(line)["name"] for line in printed.splitlines()].count("run-1.csv") == 1
        )
        process = begun()
        bench.rename(bench.parent / "away")
        time.sleep(2.0)
        assert process.poll() is None
        (bench.parent / "away").rename(bench)
        written(bench, "run-2.csv", run(2), 2)
        assert process.stdout is not None
        assert select.select([process.stdout], [], [], 90.0)[0]  # its line, which is printed last
        process.send_signal(signal.SIGINT)
        printed, said = process.communicate(timeout=60)
        assert [json.loads(line)["name"] for line in printed.splitlines()] == ["run-2.csv"], "nothing twice"
        assert said.count("It is waited for") <= 1
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()
