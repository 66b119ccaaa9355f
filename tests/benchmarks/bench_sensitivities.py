"""What derivatives along a run cost: logs of 20 s at 1 kHz, and the many short segments of a fit, against plain runs.

    python tests/benchmarks/bench_sensitivities.py [repetitions]

The drive has a knot every 20 ms. Times are the best of the repetitions; those of segments hold all that Python does.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import SensitiveRun
from fmu_models.simulation.signal import Signal

STOP = 20.0
TIMES = np.arange(20001) / 1000
KNOTS = np.linspace(0.0, STOP, 1001)
BY = ["theta", "omega", "mu_s0", "mu_k0", "p0", "k", "c", "w0"]
SEGMENTS = 60


def drive(mean: float) -> Signal:
    """A speed with the faults of a motor: once per revolution, eighth harmonic, noise."""
    noise = 0.0015 * np.random.default_rng(1).standard_normal(KNOTS.size)
    return Signal(KNOTS, mean * (1 + 0.004 * np.sin(mean * KNOTS) + 0.001 * np.sin(8 * mean * KNOTS) + noise))


def best(run: Callable[[], Any], repetitions: int) -> float:
    """Shortest wall time, ms."""
    times = []
    for _ in range(repetitions):
        begin = time.perf_counter()
        run()
        times.append(time.perf_counter() - begin)
    return 1e3 * min(times)


def log(fmu: Fmu, by: list[str], recorded: list[str], repetitions: int, **run: Any) -> str:
    """Times of one log with and without derivatives."""
    run |= {"start": {"theta": 0.05}, "inputs": {"w0": drive(0.41)}}
    with SensitiveRun(fmu, by=by, recorded=recorded) as kept:
        found = kept.run(TIMES, **run)
        exact = best(lambda: kept.run(TIMES, **run), repetitions)
    plain = best(lambda: simulate(fmu, STOP, output_times=TIMES, **run), repetitions)
    return f"{exact:6.1f} ms, plain run {plain:5.1f} ms ({found.steps} steps, {len(found.events)} events)"


def segments(fmu: Fmu, repetitions: int) -> str:
    """Time per segment of 0.3 to 0.8 s, and what of it is not the engine's."""
    rng, signal = np.random.default_rng(2), drive(0.83)
    begins, lengths = rng.uniform(0.0, 19.0, SEGMENTS), rng.uniform(0.3, 0.8, SEGMENTS)
    tables = [begin + np.arange(int(1000 * length)) / 1000 for begin, length in zip(begins, lengths, strict=True)]
    engine = 0.0
    with SensitiveRun(fmu, by=BY[:5]) as kept:

        def all_segments() -> None:
            nonlocal engine
            engine = 0.0
            for times in tables:
                near = (signal.time > times[0] - 0.02) & (signal.time < times[-1] + 0.02)
                piece = Signal(signal.time[near], signal.value[near])
                start = {"theta": 0.14, "omega": 0.1}
                engine += kept.run(times, start_time=times[0], start=start, inputs={"w0": piece}).seconds

        whole = best(all_segments, repetitions) / SEGMENTS
    return f"{whole:6.3f} ms per segment, of which {whole - 1e3 * engine / SEGMENTS:.3f} ms outside the engine"


def main(repetitions: int = 10) -> None:
    rig = Fmu.open(built("disc_rig", contacts=("disc0",)))
    elastic = Fmu.open(built("disc_rig", contacts=("disc0",), laws={"disc0": "lugre"}))
    stiff = {"parameters": {"sigma00": 5e4, "sigma10": 100.0}}
    states = ["theta", "omega"]
    more = [*BY, "z0", "sigma00"]
    print("one disc, 8 directions:              ", log(rig, BY, states, repetitions))
    print("the same with force and acceleration:", log(rig, BY, [*states, "F0", "alpha"], repetitions))
    print("bristles, 10 directions:             ", log(elastic, more, states, repetitions, **stiff))
    print("segments of 0.3 to 0.8 s, 5 directions:  ", segments(rig, repetitions))


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:]))
