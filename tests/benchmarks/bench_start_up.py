"""What people wait for before anything is computed, and for a first fit: times as multiples of a bare Python's start.

Run:  python tests/benchmarks/bench_start_up.py [--repetitions 5]
Each is a process of its own, run in turn with a bare `python -c pass`; printed is the median of the ratios of the CPU
that they took, children included, and of the seconds. The help of the command takes some 10 bare starts, the list of
models 11, a warm export 4, a first fit 130, an export that compiles 100, the very first one 20 more.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from fmu_models.codegen.package import built
from rig_io.bench.emulator import emulate, standard_set
from rig_io.packages.datapackage import write_package

BARE = 5  # starts of a bare Python that are taken together: one is as short as the clock of CPU time ticks
COMMAND = "import sys; sys.argv[1:] = {!r}; from identification.cli import main; main()"
STORE = """
import numpy as np
from fmu_models import Strobe, basins, load
from fmu_models.families.execution import Execution
grid = np.linspace(-8.0, 8.0, 1001)
system = Strobe(load("discontinuous_support"), forcing="omega", parameters={{"omega": 1.1}})
basins(system, x=grid, v=grid, most=400, execution=Execution(store={!r}))
"""  # imports and all: basins of a million starts, of which none is run again
RUN = "from fmu_models import load, simulate; simulate(load({!r}), 5.0)"
EXPORT = "from fmu_models.codegen.package import export; export({!r}, {!r}, overwrite=True)"


def cpu(code: str, cache: Path | None = None) -> float:
    """CPU time of a Python process and of what it starts, s."""
    environment = {**os.environ, **({"STICKSLIP_CACHE": str(cache)} if cache else {})}
    before = os.times()
    subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.DEVNULL, env=environment)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def show(name: str, pairs: list[tuple[float, float]]) -> None:
    """Print a line. pairs: CPU of a bare start and of the case, s."""
    ratio = statistics.median(took / bare for bare, took in pairs)
    print(f"  {name:18s} {ratio:7.1f} bare starts   {statistics.median(took for _, took in pairs):6.2f} s", flush=True)


def bare() -> float:
    """CPU time of the start of a Python that does nothing, s."""
    return sum(cpu("pass") for _ in range(BARE)) / BARE


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repetitions", type=int, default=5)
    repetitions = parser.parse_args().repetitions
    built("disc_rig")
    with TemporaryDirectory() as folder:
        logs, fmu = Path(folder) / "logs", str(Path(folder) / "a.fmu")
        runs = standard_set("paper/rubber")
        write_package(logs, [emulate(settings, 11, number) for number, settings in enumerate(runs)])
        cases = {
            "stickslip --help": COMMAND.format(["--help"]),
            "stickslip models": COMMAND.format(["models"]),
            "stickslip show": COMMAND.format(["show", "disc_rig"]),
            "stickslip simulate": COMMAND.format(["simulate", "disc_rig"]),
            "warm export": EXPORT.format("disc_rig", fmu),
            "run of a file": f"from fmu_models import load, simulate; simulate(load({fmu!r}), 5.0)",
            "the same by fmpy": f"import fmpy; fmpy.simulate_fmu({fmu!r}, stop_time=5.0, fmi_type='CoSimulation')",
            "a finished store": STORE.format(str(Path(folder) / "run.zarr")),
            "fit of four logs": "from rig_io.packages.datapackage import read_package; "
            f"from identification.fit.fit import fit_friction; fit_friction(read_package({str(logs)!r}))",
        }
        for name, code in cases.items():
            cpu(code)  # compiles and caches what is missing
            show(name, [(bare(), cpu(code)) for _ in range(repetitions)])
        first, second, third = [], [], []
        for number in range(repetitions):
            cache = Path(folder) / f"cache{number}"
            first.append((bare(), cpu(EXPORT.format("disc_rig", fmu), cache)))
            second.append((bare(), cpu(EXPORT.format("impact_pair", fmu), cache)))
            third.append((bare(), cpu(RUN.format("block_on_belt"), cache)))
        show("first export", first)
        show("another model", second)
        show("a third one's run", third)


if __name__ == "__main__":
    main()
