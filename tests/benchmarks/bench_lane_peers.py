"""The support over many frequencies by the exact flow in lanes, by heyoka.py, as many motions to an instruction as it
has, and by formulas of its own in numba, one motion after the other: the same motions, CPU time, in turn.

    python tests/benchmarks/bench_lane_peers.py [repetitions]

ns per motion and period of 256 motions over 100 periods; how many times that of lanes; median and largest difference
after 10 periods. What is not installed says so (extra `bench`).
"""

from __future__ import annotations

import importlib
import math
import sys
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from bench_lanes import FAMILIES, GO, MOTIONS, PERIODS, seconds
from numpy.typing import NDArray

from fmu_models.families.jobs import Jobs
from fmu_models.fmu.load import load
from fmu_models.sections.strobe import Strobe

Vector = NDArray[np.float64]
# s, in which an event that has just been met is not met again
COOLDOWN = 1e-6

Follow = Callable[[Vector, Vector, int], Vector]


def peers(values: Mapping[str, float]) -> dict[str, Follow | str]:
    """By name: the points (m, 2) after some periods from starts (m, 2) at frequencies (m,); or why it is not there."""
    found: dict[str, Follow | str] = {}
    for name, make in (("heyoka batch", _heyoka), ("numba, closed form", _numba)):
        try:
            found[name] = make(values)
        except ImportError as error:
            found[name] = f"{error.name} is not installed: pip install 'stickslip[bench]'"
    return found


def _numba(values: Mapping[str, float]) -> Follow:
    closed_forms = importlib.import_module("closed_forms")
    given = [values[name] for name in ("c", "f0", "ks", "cs", "g")]

    def follow(starts: Vector, frequencies: Vector, periods: int) -> Vector:
        pairs = zip(starts.tolist(), frequencies.tolist(), strict=True)
        return np.array([closed_forms.support_strobe(x, v, periods, *given, omega)[:2] for (x, v), omega in pairs])

    return follow


def _heyoka(values: Mapping[str, float]) -> Follow:
    heyoka: Any = importlib.import_module("heyoka")
    heyoka.set_logger_level_error()
    x, v = heyoka.make_vars("x", "v")
    touches, omega = heyoka.par[0], heyoka.par[1]
    c, f0, ks, cs, g = (values[name] for name in ("c", "f0", "ks", "cs", "g"))
    push = ks * (x - g) + cs * v
    rate = f0 * heyoka.cos(omega * heyoka.time) - c * v - x - touches * push

    def change(to: float) -> Callable[[Any, int, int], bool]:
        def callback(integrator: Any, sign: int, lane: int) -> bool:
            integrator.pars[0, lane] = to
            return True

        return callback

    falling, rising = heyoka.event_direction.negative, heyoka.event_direction.positive
    events = [
        heyoka.t_event_batch(x - g, callback=change(1.0), direction=rising, cooldown=COOLDOWN),
        heyoka.t_event_batch(push, callback=change(0.0), direction=falling, cooldown=COOLDOWN),
    ]
    width = int(heyoka.recommended_simd_size())
    nothing = np.zeros((2, width))
    made = heyoka.taylor_adaptive_batch([(x, v), (v, rate)], nothing, t_events=events, pars=nothing.copy())

    def follow(starts: Vector, frequencies: Vector, periods: int) -> Vector:
        ends = np.empty_like(starts)
        for i in range(0, len(starts), width):
            lanes = np.minimum(np.arange(i, i + width), len(starts) - 1)
            made.set_time(0.0)
            made.reset_cooldowns()
            made.state[:], made.pars[0], made.pars[1] = starts[lanes].T, 0.0, frequencies[lanes]
            made.propagate_until(2.0 * math.pi * periods / frequencies[lanes])
            ends[lanes] = made.state.T
        return ends

    return follow


def main(repetitions: int) -> None:
    forcing, values, varied, (low, high) = FAMILIES["discontinuous_support"]
    fmu = load("discontinuous_support")
    system = Strobe(fmu, forcing=forcing, parameters=values)
    starts, over = np.zeros((MOTIONS, 2)), np.linspace(low, high, MOTIONS)

    def lanes(starts: Vector, frequencies: Vector, periods: int) -> Vector:
        jobs = Jobs(starts, {varied: frequencies}, transient=periods - 1, rows=1)
        return system.run(jobs, GO).points[:, 0]

    given = {name: float(fmu.variables[name].start or 0.0) for name in fmu.parameters} | values
    known, ours = lanes(starts, over, 10), 0.0
    for name, follow in {"exact flow in lanes": lanes, **peers(given)}.items():
        if isinstance(follow, str):
            print(f"{name:24} skipped: {follow}")
            continue
        follow(starts, over, 1)
        taken = seconds(lambda follow=follow: follow(starts, over, PERIODS), repetitions)
        ours = ours or taken
        errors = np.abs(follow(starts, over, 10) - known).max(axis=1)
        print(f"{name:24} {1e9 * taken / MOTIONS / PERIODS:6.0f} ns {taken / ours:6.1f}", end="   ")
        print(f"difference {np.median(errors):.1e}, {errors.max():.1e}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5)
