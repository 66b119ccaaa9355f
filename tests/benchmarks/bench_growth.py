"""A chain of n masses that rub on the ground, all moving at first: what building it and an event of a run cost.

    python tests/benchmarks/bench_growth.py [n ...]

Selection of contact states is most of an event; the exponent is that of the time per event from one n to the next.
"""

from __future__ import annotations

import math
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import sympy

from fmu_models.codegen.package import export
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.contacts import Friction
from fmu_models.language.laws.coulomb import Coulomb
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Parameter
from fmu_models.simulation.run import simulate

SIZES = (8, 13, 14, 50)
REPETITIONS = 5


def chain(n: int) -> Mechanism:
    """Unit masses between springs of 100 N/m, each on the ground."""
    q = [Coordinate(f"q{i}", "m", f"place of mass {i}", velocity=f"v{i}") for i in range(n)]
    m = Parameter("m", 1.0, "kg", "mass", positive=True)
    k = Parameter("k", 100.0, "N/m", "stiffness", positive=True)
    N = Parameter("N", 1.0, "N", "normal force of each mass")
    return Mechanism(
        name=f"chain_of_{n}",
        title="chain",
        source="benchmark",
        coordinates=q,
        kinetic_energy=sympy.Add(*(m * x.v**2 / 2 for x in q)),
        potential_energy=k * q[0] ** 2 / 2 + sum(k * (q[i + 1] - q[i]) ** 2 / 2 for i in range(n - 1)),
        contacts=[
            Friction(name=f"f{i}", slip=x.v, law=Coulomb(N, sympy.Float(4 + i % 7 / 2))) for i, x in enumerate(q)
        ],
    )


def measure(n: int) -> tuple[float, float, int]:
    """Seconds to build it, microseconds per event of the fastest run, and events."""
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        fmu = Fmu.open(export(chain(n), Path(folder) / "chain.fmu"))
    built = time.perf_counter() - begin
    start = {f"q{i}": 0.3 * math.sin(1.7 * i + 0.2) for i in range(n)}
    fastest, events = math.inf, 0
    for _ in range(REPETITIONS):
        begin = time.perf_counter()
        events = len(simulate(fmu, 2.0, start=start, output_times=np.array([2.0])).events)
        fastest = min(fastest, time.perf_counter() - begin)
    return built, 1e6 * fastest / events, events


def main(sizes: tuple[int, ...]) -> None:
    print("   n   built, s   events   us per event   exponent")
    before: tuple[int, float] | None = None
    for n in sizes:
        built, cost, events = measure(n)
        exponent = "" if before is None else f"{math.log(cost / before[1]) / math.log(n / before[0]):10.2f}"
        print(f"{n:4d} {built:10.1f} {events:8d} {cost:14.1f} {exponent:>10}", flush=True)
        before = n, cost


if __name__ == "__main__":
    main(tuple(map(int, sys.argv[1:])) or SIZES)
