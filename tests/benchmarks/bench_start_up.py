"""What people wait for before anything is computed, and for a first fit: times as multiples of a bare Python's start.

Run:  python tests/benchmarks/bench_start_up.py [--repetitions 5]
Each is a process of its own, run in turn with a bare `python -c pass`; printed is the median of the ratios and of the
seconds. A warm export takes some 4 bare starts, the help of the command 6, a first fit 130.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from fmu_models.codegen.package import built
from rig_io.bench.emulator import emulate, standard_set
from rig_io.packages.datapackage import write_package


def seconds(code: str) -> float:
    """Wall time of a Python process."""
    begin = time.perf_counter()
    subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - begin


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repetitions", type=int, default=5)
    repetitions = parser.parse_args().repetitions
    built("disc_rig")
    with TemporaryDirectory() as folder:
        logs = Path(folder) / "logs"
        runs = standard_set("paper/rubber")
        write_package(logs, [emulate(settings, 11, number) for number, settings in enumerate(runs)])
        cases = {
            "stickslip --help": "import sys; sys.argv[1:] = ['--help']; from identification.cli import main; main()",
            "warm export": "from fmu_models.codegen.package import export; "
            f"export('disc_rig', {str(Path(folder) / 'a.fmu')!r}, overwrite=True)",
            "fit of four logs": "from rig_io.packages.datapackage import read_package; "
            f"from identification.fit.fit import fit_friction; fit_friction(read_package({str(logs)!r}))",
        }
        for name, code in cases.items():
            seconds(code)  # compiles and caches what is missing
            pairs = [(seconds("pass"), seconds(code)) for _ in range(repetitions)]
            ratio = statistics.median(took / bare for bare, took in pairs)
            print(f"  {name:18s} {ratio:7.1f} bare starts   {statistics.median(took for _, took in pairs):6.2f} s")


if __name__ == "__main__":
    main()
