"""Features that are flat where a step begins: error, steps and time of the engine, and of heyoka.py beside it.

    python tests/benchmarks/bench_narrow_features.py

A pulse in time and friction tanh(v/width) upon an oscillator. The reference is DOP853 at steps below the
width. heyoka.py runs at its tightest tolerance; without the extra `bench` its columns are left out.
"""

from __future__ import annotations

import math
import time

import numpy as np
import sympy
from scipy.integrate import solve_ivp

from fmu_models import TIME, Coordinate, Coulomb, Friction, Mechanism, Parameter, Tanh, load, simulate

try:
    import heyoka  # pyright: ignore[reportMissingImports]  # of the extra `bench`
except ImportError:
    heyoka = None

M = Parameter("m", 1.0, "kg", "mass", positive=True)
K = Parameter("k", 1.0, "N/m", "stiffness")
F, N = Parameter("F", 1.0, "N", "amplitude"), Parameter("N", 3.5, "N", "normal force", minimum=0.0)
MU = Parameter("mu", 0.2, "1", "friction coefficient", minimum=0.0)
CENTRE, WIDE = Parameter("t0", 5.0, "s", "centre"), Parameter("wide", 1.0, "s", "width", positive=True)
SLOW = Parameter("slow", 0.1, "m/s", "width", positive=True)
X = Coordinate("x", "m", "position", velocity="v")
ABOUT: dict = {"title": "narrow", "source": "benchmark", "coordinates": [X]}
ABOUT |= {"kinetic_energy": M * X.v**2 / 2, "potential_energy": K * X**2 / 2}
PULSE = Mechanism(name="pulse", applied={X: F * sympy.exp(-(((TIME - CENTRE) / WIDE) ** 2))}, **ABOUT)
TANH = Mechanism(name="steep", contacts=[Friction(name="floor", slip=X.v, law=Tanh(Coulomb(N, MU), SLOW))], **ABOUT)


def force(name: str, width: float, t: float, v: float) -> float:
    return math.exp(-(((t - 5.0) / width) ** 2)) if name == "pulse" else -0.7 * math.tanh(v / width)


def peer(name: str, width: float, start: list[float], end: float) -> tuple[np.ndarray, int]:
    """End state and number of steps of heyoka.py."""
    assert heyoka is not None
    x, v = heyoka.make_vars("x", "v")
    pulse = heyoka.exp(-(((heyoka.time - 5.0) / width) * ((heyoka.time - 5.0) / width)))
    added = pulse if name == "pulse" else -0.7 * heyoka.tanh(v / width)
    integrator = heyoka.taylor_adaptive([(x, v), (v, -x + added)], start, tol=1e-16)
    steps = integrator.propagate_until(end)[3]
    return np.array(integrator.state), steps


def main() -> None:
    print(f"{'case':6s} {'width':>7s} {'steps':>6s} {'ms':>7s} {'error':>8s}   heyoka: steps, error")
    for name, model, width_name, start, end in (
        ("pulse", load(PULSE), "wide", [0.0, 0.1], 10.0),
        ("tanh", load(TANH), "slow", [0.0, -1.0], 3.0),
    ):
        for width in (1.0, 0.1, 0.01):
            given = {"parameters": {width_name: width}, "start": {"v": start[1]}, "output_times": [end]}
            simulate(model, end, **given)
            begin = time.process_time()
            run = simulate(model, end, **given)
            spent = time.process_time() - begin

            def rates(t: float, y: np.ndarray, name: str = name, width: float = width) -> list[float]:
                return [y[1], -y[0] + force(name, width, t, y[1])]

            way = solve_ivp(
                rates, (0, end), start, method="DOP853", rtol=1e-12, atol=1e-14, max_step=min(0.1, width / 4)
            )
            error = np.abs([run["x"][-1] - way.y[0, -1], run["v"][-1] - way.y[1, -1]]).max()
            line = f"{name:6s} {width:7.0e} {run.steps:6d} {spent * 1e3:7.2f} {error:8.1e}"
            if heyoka is not None:
                state, steps = peer(name, width, start, end)
                line += f"   {steps:6d} {np.abs(state - way.y[:, -1]).max():8.1e}"
            print(line, flush=True)
    if heyoka is None:
        print("heyoka.py is not installed: pip install 'stickslip[bench]'")


if __name__ == "__main__":
    main()
