"""What a fit costs as the user calls it, `stickslip fit LOGS`: CPU and wall time as multiples of the plain fit's.

Run:  python tests/benchmarks/bench_fit_speed.py [--repetitions 3] [--long 200] [--against FOLDER]
Emulated benches of three logs and a free decay, clean and with disturbances; each fit is a process of its own, its
children included, run in turn with the plain fit of three clean logs of 20 s; printed are medians of the ratios. With
``--against`` another checkout of the project takes the same logs in turn. The time that a fit takes less its start
(imports and reading of the parameters) grows with the logs or less; two workers take some .6 of the wall time of one on
long logs. Run it on an idle machine.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from rig_io.bench.disturbances import Disturbances
from rig_io.bench.drive import Ripple
from rig_io.bench.emulator import emulate, standard_set
from rig_io.packages.datapackage import write_package

ROOT = Path(__file__).resolve().parents[2]
COMMAND = "from identification.cli import main; main()"
PLAIN = ("--disturbances", "none")


@dataclass(frozen=True)
class Took:
    """Time of a process and of its children, s."""

    cpu: float
    wall: float


def took(root: Path, logs: Path, options: tuple[str, ...]) -> Took:
    """The fit of these logs by the checkout at ``root``."""
    environment = {**os.environ, "PYTHONPATH": str(root)}
    before, begin = os.times(), time.perf_counter()
    arguments = [sys.executable, "-c", COMMAND, "fit", str(logs), *options]
    subprocess.run(
        arguments, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment, cwd=root
    )
    after, wall = os.times(), time.perf_counter() - begin
    return Took(after.children_user + after.children_system - before.children_user - before.children_system, wall)


def bench(folder: Path, disturbances: Disturbances, duration: float) -> Path:
    """Logs of one bench, written."""
    settings = standard_set(disturbances=disturbances, ripple=Ripple(smoothing=0.02))
    runs = [replace(one, duration=duration) if one.discs else one for one in settings]
    write_package(folder, [emulate(one, 11, number) for number, one in enumerate(runs)])
    return folder


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repetitions", type=int, default=3)
    parser.add_argument("--long", type=float, default=200.0, help="s, of each of the long logs")
    parser.add_argument("--against", type=Path, help="folder of another checkout")
    asked = parser.parse_args()
    with TemporaryDirectory() as folder:
        place = Path(folder)
        clean = bench(place / "clean", Disturbances(), 20.0)
        one = bench(place / "one", Disturbances(once=0.005), 20.0)
        two = bench(place / "two", Disturbances(once=0.02, angle=0.02), 20.0)
        long = bench(place / "long", Disturbances(), asked.long)
        cases: Mapping[str, tuple[Path, tuple[str, ...]]] = {
            "plain": (clean, PLAIN),
            "clean, auto": (clean, ()),
            "normal force .5 %": (one, ()),
            "normal force and angle": (two, ()),
            f"{asked.long:g} s, one worker": (long, (*PLAIN, "--workers", "1")),
            f"{asked.long:g} s": (long, PLAIN),
        }
        print(f"{'':24s}  CPU/plain  wall/plain     CPU s    wall s" + ("  CPU/against" if asked.against else ""))
        for name, (logs, options) in cases.items():
            took(ROOT, logs, options)  # what is built is kept
            pairs = [(took(ROOT, clean, PLAIN), took(ROOT, logs, options)) for _ in range(asked.repetitions)]
            ratios = [statistics.median(getattr(b, key) / getattr(a, key) for a, b in pairs) for key in ("cpu", "wall")]
            line = f"{name:24s}  {ratios[0]:9.2f}  {ratios[1]:10.2f}"
            line += "".join(f"  {statistics.median(getattr(b, key) for _, b in pairs):8.2f}" for key in ("cpu", "wall"))
            if asked.against:
                known = tuple(option for option in options if option not in ("--workers", "1"))
                others = [took(asked.against.resolve(), logs, known).cpu for _ in range(asked.repetitions)]
                line += f"  {statistics.median(b.cpu for _, b in pairs) / statistics.median(others):11.2f}"
            print(line, flush=True)


if __name__ == "__main__":
    main()
