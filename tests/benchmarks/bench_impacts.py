"""Bouncing ball on a shaking table, per impact: error and time of the engine and of heyoka.py, run in turn.

    python tests/benchmarks/bench_impacts.py [repetitions]

Gamma = 0.8 and e = 0.8, in units in which gravity and the frequency of the table are 1. The start lies beside the
stable motion of one impact per period, which never chatters: both sides do the same impacts. Both are what a user
calls, ours by simulate; heyoka at 1e-12 and at our tolerance, 1e-14, by a terminal event whose callback turns the
velocity. Integrators are made, and the library is loaded, outside the timing. The reference solves the equation of
every flight with 30 digits. Needs the extra `bench`.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

import heyoka  # pyright: ignore[reportMissingImports]  # of the extra `bench`
import mpmath
import numpy as np

from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate

GAMMA, E = 0.8, 0.8
IMPACTS = 1000
PHASE = float(mpmath.acos(mpmath.pi * (1 - E) / ((1 + E) * GAMMA)))
# on the motion of period one, but for the speed
HEIGHT, SPEED = GAMMA * float(mpmath.sin(PHASE)) + 0.1, GAMMA * float(mpmath.cos(PHASE)) + 3.0


def reference() -> tuple[float, np.ndarray]:
    """A time in the flight after the last impact, and height and speed of the ball there."""
    with mpmath.workdps(30):
        t, x, v = mpmath.mpf(PHASE), mpmath.mpf(HEIGHT), mpmath.mpf(SPEED)
        for _ in range(IMPACTS):
            since = mpmath.findroot(
                lambda s, t=t, x=x, v=v: x + v * s - s**2 / 2 - GAMMA * mpmath.sin(t + s), (5.0, 7.5), solver="anderson"
            )
            t, x, v = t + since, x + v * since - since**2 / 2, v - since
            v = -E * v + (1 + E) * GAMMA * mpmath.cos(t)
        stop = float(t) + 1.0
        rest = stop - t
        return stop, np.array([float(x + v * rest - rest**2 / 2), float(v - rest)])


def peer(stop: float, tolerance: float) -> Callable[[], tuple[np.ndarray, int]]:
    """The run by heyoka.py and what it returns, the end state and the number of impacts."""
    x, v = heyoka.make_vars("x", "v")
    impacts = 0

    def turn(integrator: Any, _side: int) -> bool:
        nonlocal impacts
        impacts += 1
        state = integrator.state
        state[1] = -E * state[1] + (1 + E) * GAMMA * np.cos(integrator.time)
        return True

    event = heyoka.t_event(
        x - GAMMA * heyoka.sin(heyoka.time), callback=turn, direction=heyoka.event_direction.negative
    )
    integrator = heyoka.taylor_adaptive(
        [(x, v), (v, heyoka.expression(-1.0))], [HEIGHT, SPEED], t_events=[event], tol=tolerance
    )

    def run() -> tuple[np.ndarray, int]:
        nonlocal impacts
        impacts = 0
        integrator.time, integrator.state[:] = PHASE, (HEIGHT, SPEED)
        integrator.reset_cooldowns()
        integrator.propagate_until(stop)
        return integrator.state.copy(), impacts

    return run


def ours(stop: float) -> Callable[[], tuple[np.ndarray, int]]:
    """The same by a run of the exported FMU."""
    fmu = Fmu.open(built("bouncing_ball"))
    parameters = {"g": 1.0, "A": GAMMA, "omega": 1.0, "e": E}

    def run() -> tuple[np.ndarray, int]:
        start = {"x": HEIGHT, "v": SPEED}
        made = simulate(fmu, stop, start_time=PHASE, parameters=parameters, start=start, output_times=[stop])
        return np.array([made["x"][0], made["v"][0]]), len(made.events)

    return run


def main(repetitions: int = 100) -> None:
    heyoka.set_logger_level_error()
    stop, exact = reference()
    peers = {f"heyoka {tolerance:g}": peer(stop, tolerance) for tolerance in (1e-12, 1e-14)}
    calls = {"ours": ours(stop), **peers}
    calls["ours"]()  # loads the library
    times: dict[str, list[float]] = {name: [] for name in calls}
    ends: dict[str, tuple[np.ndarray, int]] = {}
    for _ in range(repetitions):
        for name, run in calls.items():
            begin = time.perf_counter()
            ends[name] = run()
            times[name].append(time.perf_counter() - begin)
    for name, (state, impacts) in ends.items():
        error = np.abs(state - exact).max()
        each = statistics.median(times[name]) / impacts * 1e6
        print(f"{name:13s} error {error:8.1e}  impacts {impacts:4d}  median {each:.3f} us per impact")
    for name in peers:
        ratio = statistics.median(a / b for a, b in zip(times["ours"], times[name], strict=True))
        print(f"time, ours/{name}: median of pairs {ratio:.2f}")


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:]))
