"""Foreign FMUs under the master and under fmpy's CVode, run in turn: error against a tight reference, CPU time,
ratio.

    python tests/benchmarks/bench_foreign.py [repetitions]

Both run an instance that is loaded already (fmpy: unpacked, instantiated, reset by itself), for the end value alone;
the master by run(), which makes a trajectory with its events, and as one of a sweep, which makes the values alone.
Each has a ladder of tolerances; the pair of each rung of fmpy's is the master's cheapest that is at least as accurate.
fmpy's communication interval is the longest at which CVode does not run out of its 500 steps.
Also: overhead of a run of a kept instance, and a relay that slides.
"""

from __future__ import annotations

import contextlib
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import simulate_fmu
from fmpy.simulation import instantiate_fmu

sys.path.append(str(Path(__file__).parents[1] / "foreign"))
from models import foreign

from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.driver import Driver
from fmu_models.importer.simulate import simulate_any

LADDER = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
SWEPT = 20
INTERVALS = (1, 5, 20, 100, 500, 2000, 20000)


@dataclass(frozen=True)
class Case:
    """A model with its parameters, the end of the run in s, the ratio of times it must show."""

    name: str
    model: str
    stop: float
    parameters: Mapping[str, float]
    wanted: float


CASES = (
    Case("van der Pol, mu = 1", "van_der_pol", 2000.0, {}, 50),
    Case("bouncing ball", "ball", 8.0, {"e": 0.9}, 50),
    Case("Dahlquist", "dahlquist", 10.0, {}, 10),
    Case("time events, as Stair", "clock", 9.95, {}, 10),
    Case("van der Pol, mu = 1000", "van_der_pol", 2000.0, {"mu": 1000.0}, 5),
    Case("Robertson", "robertson", 1e4, {}, 5),
)


@contextlib.contextmanager
def silent() -> Iterator[None]:
    """Without what CVode prints when it gives up."""
    kept = os.dup(2)
    with open(os.devnull, "w") as nothing:
        os.dup2(nothing.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)


def peer(fmu: Fmu, case: Case, tolerance: float) -> Callable[[], np.ndarray] | None:
    """A run by fmpy; None if CVode cannot make it at this tolerance."""
    instance = instantiate_fmu(str(fmu.folder), fmu.description, "ModelExchange")
    names = fmu.states

    def run(interval: float) -> np.ndarray:
        instance.reset()  # pyright: ignore[reportAttributeAccessIssue]  # FMI 1 has none
        result: Any = simulate_fmu(
            str(fmu.folder),
            stop_time=case.stop,
            relative_tolerance=tolerance,
            output_interval=interval,
            start_values=dict(case.parameters),
            output=names,
            model_description=fmu.description,
            fmu_instance=instance,
            fmi_type="ModelExchange",
            validate=False,
        )
        return np.array([result[name][-1] for name in names])

    for pieces in INTERVALS:
        with silent(), contextlib.suppress(RuntimeError):
            run(case.stop / pieces)
            return lambda: run(case.stop / pieces)
    return None


def ours(driver: Driver, case: Case) -> Callable[[], np.ndarray]:
    def run() -> np.ndarray:
        result = driver.run(case.stop, parameters=case.parameters, output_times=[case.stop])
        return np.array([result[name][-1] for name in driver.fmu.states])

    return run


def sweep(driver: Driver, case: Case) -> Callable[[], np.ndarray]:
    """The same run SWEPT times."""
    name = driver.fmu.states[0]
    values = {name: float(driver.fmu.variables[name].start or 0), **case.parameters}
    batch = driver.batch(case.stop, tuple(values))
    rows = np.tile(list(values.values()), (SWEPT, 1))
    return lambda: batch.runs(rows)[0][:, :, 0]


def timed(run: Callable[[], object]) -> float:
    """CPU time of a run, s."""
    with silent():
        begin = time.process_time()
        with contextlib.suppress(RuntimeError):
            run()
        return time.process_time() - begin


def compare(case: Case, folder: Path, repetitions: int) -> None:
    fmu = Fmu.open(foreign(case.model, folder))
    with Driver(fmu, method="auto", tolerance=1e-13) as tight:
        reference = ours(tight, case)()
    scale = np.maximum(np.abs(reference), 1e-3 * np.abs(reference).max())

    def error(run: Callable[[], np.ndarray]) -> float:
        return float(np.abs((run() - reference) / scale).max())

    drivers = {tolerance: Driver(fmu, tolerance=tolerance, record=[]) for tolerance in LADDER}
    mine = {tolerance: ours(driver, case) for tolerance, driver in drivers.items()}
    errors = {tolerance: error(run) for tolerance, run in mine.items()}
    print(f"{case.name}, to {case.stop:g} s (wanted: {case.wanted:g} times)")
    for tolerance in LADDER[1:6]:
        other = peer(fmu, case, tolerance)
        if other is None:
            print(f"  fmpy {tolerance:.0e}: CVode gives up")
            continue
        reached = error(other)
        enough = [t for t in LADDER if errors[t] <= reached]
        if not enough:
            print(f"  fmpy {tolerance:.0e}: error {reached:.1e}, not reached")
            continue
        many = sweep(drivers[enough[0]], case)
        times = [(timed(other), timed(mine[enough[0]]), timed(many) / SWEPT) for _ in range(repetitions)]
        by_run, in_sweep = (statistics.median(row[0] / row[k] for row in times) for k in (1, 2))
        a, b, c = (statistics.median(column) * 1e3 for column in zip(*times, strict=True))
        print(
            f"  fmpy {tolerance:.0e}: error {reached:.1e}, {a:8.2f} ms; master {enough[0]:.0e}: error "
            f"{errors[enough[0]]:.1e}, {b:7.3f} ms, in a sweep {c:7.3f} ms; "
            f"ratios, medians of pairs {by_run:.0f} and {in_sweep:.0f}"
        )
    for driver in drivers.values():
        driver.close()


def whole_calls(case: Case, folder: Path, repetitions: int) -> None:
    """What a user types, from the file on: unpacking, loading, running, a table of 1001 rows; CPU time."""
    path = foreign(case.model, folder)
    options: dict[str, Any] = {"start_values": dict(case.parameters), "relative_tolerance": 1e-6, "validate": False}
    options |= {"fmi_type": "ModelExchange", "output_interval": case.stop / 1000}

    times = [
        (
            timed(lambda: simulate_fmu(str(path), stop_time=case.stop, **options)),
            timed(lambda: simulate_any(path, case.stop, tolerance=1e-6, parameters=case.parameters)),
        )
        for _ in range(repetitions + 1)
    ][1:]
    theirs, mine = (statistics.median(column) * 1e3 for column in zip(*times, strict=True))
    ratio = statistics.median(a / b for a, b in times)
    print(f"  whole call at 1e-6, CPU: fmpy {theirs:.1f} ms, master {mine:.1f} ms, median ratio {ratio:.1f}")


def overhead(folder: Path) -> None:
    """A run as short as can be, ten thousand times: all of it is overhead."""
    runs = 10_000
    with Driver(Fmu.open(foreign("relay", folder)), record=[]) as driver:
        values = np.linspace(0.1, 0.9, runs)[:, None]
        begin = time.perf_counter()
        driver.batch(1e-6, ("a",)).runs(values)
        swept = time.perf_counter() - begin
        begin = time.perf_counter()
        for _ in range(runs):
            driver.run(1e-6, output_times=[1e-6])
        single = time.perf_counter() - begin
    in_sweep, by_run = swept / runs * 1e6, single / runs * 1e6
    print(f"overhead of one of {runs} runs: in a sweep {in_sweep:.1f} us (wanted: < 20), by run() {by_run:.1f} us")


def slide(folder: Path) -> None:
    with Driver(Fmu.open(foreign("relay", folder))) as driver:
        begin = time.perf_counter()
        run = driver.run(20.0)
        elapsed = time.perf_counter() - begin
    begins = run.events[0].time
    off = np.abs(run["x"][run.time > begins]).max()
    took = elapsed * 1e3
    print(f"relay: slides from t = {begins:.6f} s, |x| <= {off:.1e} to 20 s, {took:.2f} ms (wanted: < 100)")


def main(repetitions: int = 7) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for case in CASES:
            compare(case, folder, repetitions)
            whole_calls(case, folder, repetitions)
        overhead(folder)
        slide(folder)


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:]))
