"""Ensembles and exponents against peers: the same starts, periods and accuracy, in turn, by the CPU time of one thread.

    python tests/benchmarks/bench_family_peers.py [repetitions]

    free      256 motions of the support that never touch it, 60 periods: a forced linear oscillator
    touching  a grid of 441 starts, 60 periods, with all touches of the support
    exponents both of the Hénon map, a million steps

Ours twice: strobes by the exact flow in lanes, which ensembles choose by themselves, and by the series of the engine.
Peers: the flow in closed form in numba (closed_forms.py); heyoka.py, four motions a batch, by terminal events whose
callback changes the mode; pynamicalsys, whose Runge-Kutta methods know no events. Making integrators and compiling are
outside the timing. Errors are the largest distance from the closed form after all periods; tolerances of the peers are
the loosest that keep 1e-9. Needs the extra `bench`.
"""

from __future__ import annotations

import math
import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

import heyoka  # pyright: ignore[reportMissingImports]  # of the extra `bench`
import numpy as np
from closed_forms import support_strobes
from numba import njit  # pyright: ignore[reportMissingImports]
from pynamicalsys import ContinuousDynamicalSystem, DiscreteDynamicalSystem  # pyright: ignore[reportMissingImports]

from fmu_models import maps
from fmu_models.analyses.lyapunov import lyapunov
from fmu_models.families.execution import Execution
from fmu_models.families.jobs import Jobs
from fmu_models.fmu.load import load
from fmu_models.sections.iteration import Iteration
from fmu_models.sections.strobe import Strobe

C, F0, KS, CS, G, OMEGA = 0.05, 0.5, 10.0, 0.3, 4.0, 1.18
PERIOD, PERIODS, LANES = 2.0 * math.pi / OMEGA, 60, 4
STEPS = 1_000_000


def ours(starts: np.ndarray, stepper: str = "auto") -> Callable[[], np.ndarray]:
    """By the exact flow in lanes, or by the series of the engine."""
    values = {"ks": KS, "omega": OMEGA}
    support = Strobe(load("discontinuous_support"), forcing="omega", parameters=values, stepper=stepper)
    jobs = Jobs(starts, transient=PERIODS - 1, rows=1)
    return lambda: support.make(jobs, workers=1).points[:, 0]


def closed(starts: np.ndarray) -> Callable[[], np.ndarray]:
    return lambda: support_strobes(starts, PERIODS, C, F0, KS, CS, G, OMEGA)


def batches(starts: np.ndarray, tolerance: float) -> Callable[[], np.ndarray]:
    """By heyoka.py; a parameter of each lane is 1 while it touches."""
    x, v = heyoka.make_vars("x", "v")
    touches = heyoka.par[0]
    force = KS * (x - G) + CS * v
    rate = F0 * heyoka.cos(OMEGA * heyoka.time) - C * v - x - touches * force

    def turn(integrator: Any, _side: int, lane: int) -> bool:
        integrator.pars[0, lane] = 1.0 - integrator.pars[0, lane]
        return True

    event = heyoka.t_event_batch(
        (1.0 - touches) * (G - x) + touches * force, callback=turn, direction=heyoka.event_direction.negative
    )
    integrator = heyoka.taylor_adaptive_batch(
        [(x, v), (v, rate)], np.zeros((2, LANES)), pars=np.zeros((1, LANES)), t_events=[event], tol=tolerance
    )
    padded = np.concatenate([starts, starts[: -len(starts) % LANES]])

    def run() -> np.ndarray:
        ends = np.empty_like(padded)
        for i in range(0, len(padded), LANES):
            part = padded[i : i + LANES].T
            integrator.set_time(0.0)
            integrator.state[:] = part
            integrator.pars[:] = (KS * (part[0] - G) + CS * part[1] > 0.0) & (part[0] >= G)
            integrator.reset_cooldowns()
            integrator.propagate_until(PERIODS * PERIOD)
            ends[i : i + LANES] = integrator.state.T
        return ends[: len(starts)]

    return run


def runge_kutta(starts: np.ndarray) -> Callable[[], np.ndarray]:
    """By pynamicalsys; without the support."""

    @njit
    def rates(t, u, p):
        made = np.empty(2)
        made[0], made[1] = u[1], p[0] * math.cos(p[1] * t) - p[2] * u[1] - u[0]
        return made

    system = ContinuousDynamicalSystem(equations_of_motion=rates, system_dimension=2, number_of_parameters=3)
    # its steps of variable length end beyond the time asked for
    system.integrator("rk4", time_step=np.float64(PERIOD / 500))
    parameters = [F0, OMEGA, C]

    def run() -> np.ndarray:
        return np.asarray(system.stroboscopic_map(starts, PERIODS, PERIOD, parameters=parameters))[:, -1, 1:]

    return run


def exponents() -> dict[str, Callable[[], np.ndarray]]:
    henon = Iteration.of(maps.load("henon"))
    other = DiscreteDynamicalSystem(model="henon map")
    start, parameters = [0.1, 0.1], [1.4, 0.3]
    return {
        "stickslip": lambda: (
            lyapunov(henon, periods=STEPS, transient=100, motions=1000, execution=Execution(workers=1)).values
        ),
        "pynamicalsys": lambda: np.asarray(other.lyapunov(start, STEPS, parameters=parameters, transient_time=100)),
    }


def in_turn(runs: dict[str, Callable[[], np.ndarray]], repetitions: int) -> tuple[dict[str, float], dict[str, Any]]:
    """Median CPU time in s and result of each."""
    results = {name: run() for name, run in runs.items()}
    times: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(repetitions):
        for name, run in runs.items():
            begin = time.process_time()
            run()
            times[name].append(time.process_time() - begin)
    return {name: statistics.median(one) for name, one in times.items()}, results


def table(title: str, work: float, unit: str, times: dict[str, float], notes: dict[str, str]) -> None:
    print(f"\n{title}\n  {'':14} {'us per ' + unit:>14} {'times ours':>11}")
    for name, seconds in times.items():
        print(f"  {name:14} {1e6 * seconds / work:14.3f} {seconds / times['stickslip']:11.2f}  {notes[name]}")


def main(repetitions: int) -> None:
    small = np.random.default_rng(0).uniform(-1.0, 1.0, (256, 2))
    line = np.linspace(-8.0, 8.0, 21)
    grid = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    for title, starts in (("free", small), ("touching", grid)):
        runs = {"stickslip": ours(starts), "our series": ours(starts, "taylor"), "closed form": closed(starts)}
        runs["heyoka batch"] = batches(starts, 1e-12)
        if title == "free":
            runs["pynamicalsys"] = runge_kutta(starts)
        times, results = in_turn(runs, repetitions)
        errors = {name: np.abs(found - results["closed form"]).max() for name, found in results.items()}
        notes = {name: f"largest difference {error:.1e}" for name, error in errors.items()}
        table(title, len(starts) * PERIODS, "period", times, notes)
    times, results = in_turn(exponents(), repetitions)
    table(
        "exponents", STEPS, "step", times, {name: f"{found[0]:.5f} {found[1]:.5f}" for name, found in results.items()}
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5)
