"""Stick-slip of the disc rig for 25 s (48 events): error and time of the engine and of heyoka.py, called in turn.

    python tests/benchmarks/bench_native_run.py [repetitions]

Both integrate from rest, by what a user calls: ours by one call of simulate at its default tolerance, beside which the
time of the engine in it is shown; heyoka by one loop over events at 1e-12, whose stick phases are closed-form here. The
first call of each is outside the timing. The reference is heyoka.py at its tightest tolerance. Needs the extra `bench`.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable

import heyoka  # pyright: ignore[reportMissingImports]  # of the extra `bench`
import numpy as np

from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate

STOP = 25.0
J, K, C, R, DISC, N, MU_S, MU_K, P, W = 0.0548, 2.62, 0.055, 0.125, 0.06, 8.0, 0.65, 0.35, 15.0, 0.83


def peer(tolerance: float) -> Callable[[], tuple[np.ndarray, int]]:
    """Event-driven stick-slip by heyoka.py: the run and what it returns, the end state and the number of events."""
    theta, omega = heyoka.make_vars("theta", "omega")
    sign = heyoka.par[0]
    slip = DISC * W - R * omega
    mu = (MU_S - MU_K) / (1.0 + P * sign * slip) + MU_K
    acceleration = (-C * omega - K * theta + R * N * mu * sign) / J
    # only a fall of the slip counts: a release leaves zero slip upwards
    event = heyoka.t_event(sign * slip, direction=heyoka.event_direction.negative)
    integrator = heyoka.taylor_adaptive(
        [(theta, omega), (omega, acceleration)], [0.0, 0.0], pars=[1.0], t_events=[event], tol=tolerance
    )
    speed = DISC * W / R
    release = (R * N * MU_S - C * speed) / K

    def run() -> tuple[np.ndarray, int]:
        integrator.time, integrator.state[:], integrator.pars[0] = 0.0, 0.0, 1.0
        integrator.reset_cooldowns()
        events = 0
        while True:
            integrator.propagate_until(STOP)
            if integrator.time >= STOP:
                return integrator.state.copy(), events
            events += 1
            angle = integrator.state[0]
            if abs(C * speed + K * angle) >= R * N * MU_S:
                integrator.pars[0] = -integrator.pars[0]
                continue
            end = integrator.time + (release - angle) / speed
            if end >= STOP:
                return np.array([angle + speed * (STOP - integrator.time), speed]), events
            events += 1
            integrator.state[:] = release, speed
            integrator.time, integrator.pars[0] = end, 1.0
            integrator.reset_cooldowns()

    return run


def ours() -> Callable[[], tuple[np.ndarray, int, float]]:
    """The same through the exported FMU: end state, number of events, and the engine's part of the time."""
    fmu = Fmu.open(built("disc_rig", contacts=("disc0",)))

    def run() -> tuple[np.ndarray, int, float]:
        made = simulate(fmu, STOP, parameters={"N0": N}, inputs={"w0": W}, output_times=[STOP])
        return np.array([made["theta"][0], made["omega"][0]]), len(made.events), made.seconds

    return run


def main(repetitions: int = 200) -> None:
    heyoka.set_logger_level_error()
    reference, _ = peer(1e-16)()
    run_peer, run_ours = peer(1e-12), ours()
    times: dict[str, list[float]] = {"ours": [], "engine": [], "heyoka": []}
    state_ours, events_ours, _ = run_ours()
    state_peer, events_peer = run_peer()
    for _ in range(repetitions):
        begin = time.perf_counter()
        state_ours, events_ours, of_engine = run_ours()
        times["ours"].append(time.perf_counter() - begin)
        times["engine"].append(of_engine)
        begin = time.perf_counter()
        state_peer, events_peer = run_peer()
        times["heyoka"].append(time.perf_counter() - begin)
    for name, state, events in (("ours", state_ours, events_ours), ("heyoka", state_peer, events_peer)):
        error = np.abs(state - reference).max()
        print(f"{name:7s} error {error:8.1e}  events {events:3d}  median {statistics.median(times[name]) * 1e3:.3f} ms")
    for name in ("ours", "engine"):
        ratio = statistics.median(a / b for a, b in zip(times[name], times["heyoka"], strict=True))
        print(f"time, {name}/heyoka: median of pairs {ratio:.2f}")


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:]))
