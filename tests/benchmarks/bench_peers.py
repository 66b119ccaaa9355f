"""Error and time of the engine, of heyoka.py and of scipy with events on three motions, run in turn.

    python tests/benchmarks/bench_peers.py [repetitions]

    P1  stick-slip of the disc rig from rest, 25 s, 48 events
    P2  oscillator with a discontinuous support (Table 1) from rest, 40 periods, 72 events
    P3  ball on a table, Gamma = 0.8, e = 0.8, on its stable motion of period one, 200 impacts

heyoka.py as its own users would write it, per motion: one compiled integrator, its events answered by callbacks, stick
in closed form. ``stickslip bench`` runs it from the declarations, with the decisions in Python. Ours is one call of
simulate, all of it timed. Integrators are made, and the library is loaded, outside the times. Needs the extra `bench`.
"""

from __future__ import annotations

import dataclasses
import math
import statistics
import sys
import time
from collections.abc import Callable, Mapping
from typing import Any

import bench_native_run
import heyoka  # pyright: ignore[reportMissingImports]  # of the extra `bench`
import numpy as np

from fmu_models.validation.bench.problems import of_model, of_scene
from fmu_models.validation.bench.reference import reference
from fmu_models.validation.methods.event_taylor import EventTaylor
from fmu_models.validation.methods.result import MethodProblem
from fmu_models.validation.methods.scipy_events import ScipyEvents

Peer = Callable[[], tuple[np.ndarray, int]]


def of(name: str, stop: float, contacts: tuple[str, ...] | None = None, **values: Mapping[str, float]) -> MethodProblem:
    """A model with other values."""
    scene = of_model(name)
    fixed, start = {**scene.fixed, **values.get("fixed", {})}, dict(values.get("start", {}))
    return of_scene(dataclasses.replace(scene, contacts=contacts, fixed=fixed, start=start, stop_time=stop))


def support_peer(tolerance: float, stop: float) -> Peer:
    """P2."""
    x, v = heyoka.make_vars("x", "v")
    touching = heyoka.par[0]
    force = 10.0 * (x - 4.0) + 0.3 * v
    acceleration = 0.5 * heyoka.cos(heyoka.time) - 0.05 * v - x - touching * force
    count = [0]

    def touch(integrator: Any, _: int) -> bool:
        integrator.pars[0] = 1.0
        count[0] += 1
        return True

    def release(integrator: Any, _: int) -> bool:
        # the force also falls to zero in free flight, where the mass turns before it touches
        count[0] += integrator.pars[0] == 1.0
        integrator.pars[0] = 0.0
        return True

    events = [
        heyoka.t_event(x - 4.0, direction=heyoka.event_direction.positive, callback=touch),
        heyoka.t_event(force, direction=heyoka.event_direction.negative, callback=release),
    ]
    integrator = heyoka.taylor_adaptive([(x, v), (v, acceleration)], [0.0, 0.0], t_events=events, tol=tolerance)

    def run() -> tuple[np.ndarray, int]:
        integrator.time, integrator.state[:], integrator.pars[0] = 0.0, 0.0, 0.0
        integrator.reset_cooldowns()
        count[0] = 0
        integrator.propagate_until(stop)
        return integrator.state.copy(), count[0]

    return run


def ball_peer(tolerance: float, stop: float, phase: float) -> Peer:
    """P3."""
    x, v = heyoka.make_vars("x", "v")
    table = 0.8 * heyoka.sin(heyoka.time + phase)
    count = [0]

    def bounce(integrator: Any, _: int) -> bool:
        speed = 0.8 * math.cos(integrator.time + phase)
        integrator.state[1] = -0.8 * integrator.state[1] + 1.8 * speed
        count[0] += 1
        return True

    event = heyoka.t_event(x - table, direction=heyoka.event_direction.negative, callback=bounce)
    start = [0.8 * math.sin(phase), math.pi]
    integrator = heyoka.taylor_adaptive([(x, v), (v, heyoka.expression(-1.0))], start, t_events=[event], tol=tolerance)

    def run() -> tuple[np.ndarray, int]:
        integrator.time, integrator.state[:] = 0.0, start
        integrator.reset_cooldowns()
        count[0] = 0
        integrator.propagate_until(stop)
        return integrator.state.copy(), count[0]

    return run


def cases() -> dict[str, tuple[MethodProblem, Callable[[float], Peer]]]:
    """The three problems, and what makes their peers at a tolerance."""
    rig = of("disc_rig", bench_native_run.STOP, ("disc0",), fixed={"N0": 8.0, "w0": 0.83})
    support = of("discontinuous_support", 80.0 * math.pi, start={"x": 0.0, "v": 0.0})
    phase = math.acos(math.pi * 0.2 / (1.8 * 0.8))
    # 200.5 periods: the last state is one in flight
    fixed = {"g": 1.0, "omega": 1.0, "A": 0.8, "e": 0.8, "phi0": phase}
    ball = of("bouncing_ball", 401.0 * math.pi, fixed=fixed, start={"x": 0.8 * math.sin(phase), "v": math.pi})
    return {
        "P1": (rig, bench_native_run.peer),
        "P2": (support, lambda tolerance: support_peer(tolerance, support.stop_time)),
        "P3": (ball, lambda tolerance: ball_peer(tolerance, ball.stop_time, phase)),
    }


def measure(name: str, problem: MethodProblem, make_peer: Callable[[float], Peer], repetitions: int) -> None:
    """Print one motion."""
    known = reference(problem)
    print(f"{name}: {problem.name}, {problem.stop_time:.6g} s. Reference: {known.sentence}")
    ours, peer = EventTaylor().prepare(problem), make_peer(1e-12)
    made = ours(1e-14)
    state, events = peer()
    times: list[tuple[float, float]] = []
    for _ in range(repetitions):
        seconds = ours(1e-14).seconds
        begin = time.perf_counter()
        peer()
        times.append((seconds, time.perf_counter() - begin))
    mine, theirs = (statistics.median(column) for column in zip(*times, strict=True))
    ratio = statistics.median(a / b for a, b in times)
    found = len([s for s in made.switches or () if s.matters])
    print(f"  stickslip     error {known.error(made.end):8.1e}  events {found:4d}  {mine * 1e3:9.3f} ms")
    print(f"  heyoka 1e-12  error {known.error(state):8.1e}  events {events:4d}  {theirs * 1e3:9.3f} ms")
    scipy = ScipyEvents("DOP853").prepare(problem)
    for tolerance in (1e-8, 1e-12):
        run = scipy(tolerance)
        seconds = statistics.median(scipy(tolerance).seconds for _ in range(5))
        error, events = known.error(run.end), len(run.switches or ())
        print(f"  scipy {tolerance:.0e}   error {error:8.1e}  events {events:4d}  {seconds * 1e3:9.3f} ms")
        print(f"    {seconds / mine:.0f} times as long as ours")
    print(f"  time, ours/heyoka: median of pairs {ratio:.2f}")


def main(repetitions: int = 100) -> None:
    """Print all of them."""
    heyoka.set_logger_level_error()
    for name, (problem, make_peer) in cases().items():
        measure(name, problem, make_peer, repetitions)


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:]))
