"""A grid of extremes judged by one child process and by two, in turn: wall time and CPU, and their ratios.

Run:  python tests/benchmarks/bench_stress_workers.py [--repetitions 3] [MODEL ...]
Of two free cores the grid of two models takes .55 to .65 of the time of one; the second child costs some 1.5 s of CPU,
because it imports and lowers too. Where the cores are not free the ratio of the times says nothing.
"""

from __future__ import annotations

import argparse
import os
import statistics
import time

from fmu_models.validation.stress.workers import cases_of, judged, judges


def seconds(models: list[str], processes: int) -> tuple[float, float]:
    """Wall time and CPU of the children, from before they start to the last cell."""
    begin, before = time.perf_counter(), os.times()
    with judges(processes) as pool:
        cells = list(judged([case for name in models for case in cases_of(name)], lambda _: None, pool))
    assert cells
    after = os.times()
    cpu = sum(after[i] - before[i] for i in (2, 3))
    return time.perf_counter() - begin, cpu


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="*", default=["disc_rig", "discontinuous_support"])
    parser.add_argument("--repetitions", type=int, default=3)
    asked = parser.parse_args()
    seconds(asked.models, 1)  # builds what is missing
    pairs = [(seconds(asked.models, 1), seconds(asked.models, 2)) for _ in range(asked.repetitions)]
    for which, what in enumerate(("wall time", "CPU of children")):
        ratio = statistics.median(two[which] / one[which] for one, two in pairs)
        one, two = (statistics.median(pair[count][which] for pair in pairs) for count in (0, 1))
        print(f"  {what:16s} one {one:6.2f} s   two {two:6.2f} s   ratio {ratio:.2f}")


if __name__ == "__main__":
    main()
