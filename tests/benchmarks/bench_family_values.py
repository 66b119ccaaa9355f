"""Values of families of motions that take longer than tests may: found, trusted, and how far apart in standard errors.

    python tests/benchmarks/bench_family_values.py

exponents  long runs against those of independent engines (../physics/families_reference.json says how they were made)
pulls      (found - trusted) / error over 20 seeds: the mean of their squares is near 1 where errors are honest
basin      of the hinge at f = 0.418, 41 x 41 starts, against closed_forms.py with ever finer steps where they differ
cell       of the period chart of the support, omega = 0.92, f0 = 0.66: where the motion is after so many periods

Minutes of work. Needs the extra `bench`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from closed_forms import hinge_strobes, support_strobe

from fmu_models.analyses.basins import basins
from fmu_models.analyses.lyapunov import lyapunov
from fmu_models.fmu.load import load
from fmu_models.sections.strobe import Strobe

TABLE_2 = {"ks": 300.0, "cs": 0.6, "g": 1.6}
FIGURE_10 = {"ks": 1000.0, "cs": 0.6, "g": 2.0, "f0": 0.7}
REST = {"x": 0.0, "v": 0.0}
# system, frequency, start, steps, exponents per time (of stick-slip per step) with their errors
LISTED: list[tuple[str, str, dict[str, float], dict[str, float], int, list[tuple[float, float]]]] = [
    ("support", "omega", {**TABLE_2, "omega": 0.94}, REST, 500_000, [(0.05625, 2.9e-5), (-0.11654, 2.9e-5)]),
    ("support", "omega", {**TABLE_2, "omega": 0.93}, REST, 500_000, [(0.056905, 3.0e-5), (-0.11655, 3.0e-5)]),
    ("support", "omega", {**FIGURE_10, "omega": 0.9}, REST, 2_000_000, [(0.037968, 4.8e-5), (-0.092877, 4.8e-5)]),
    ("hinge", "f", {"f": 0.41}, REST, 40_000, [(0.131869, 1.82e-4), (-0.781849, 1.84e-4)]),
    ("hinge", "f", {"f": 0.405}, REST, 40_000, [(0.25799, 2.41e-4), (-0.895399, 2.35e-4)]),
    ("hinge", "f", {"f": 0.37}, REST, 40_000, [(0.252249, 4.29e-4), (-0.842668, 3.78e-4)]),
    ("stick-slip", "omega", {"omega": 1.668}, {"x": 2.1419, "v": -0.528}, 200_000, [(0.33087, 4.2e-4)]),
    ("stick-slip", "omega", {"omega": 1.67587}, {"x": 2.0798, "v": -0.62}, 200_000, [(0.30601, 4.6e-4)]),
]
MODELS = {"support": "discontinuous_support", "hinge": "hinge_clearance", "stick-slip": "forced_stick_slip"}


def strobe(name: str, forcing: str, parameters: dict[str, float]) -> Strobe:
    return Strobe(load(MODELS[name]), forcing=forcing, parameters=parameters, every=2 if name == "stick-slip" else 1)


def exponents() -> None:
    print(f"{'exponents':32} {'found':>11} {'error':>9} {'trusted':>11} {'error':>9} {'apart':>6}")
    for name, forcing, parameters, start, steps, known in LISTED:
        found = lyapunov(strobe(name, forcing, parameters), start, periods=steps, transient=2000)
        step = name == "stick-slip"
        values, errors = (found.values, found.errors) if step else (found.per_time, found.per_time_errors)
        for value, error, (trusted, its) in zip(values, errors, known, strict=False):
            apart = abs(value - trusted) / math.hypot(error, its)
            row = f"{name} {forcing} = {parameters[forcing]:g}"
            print(f"{row:32} {value:11.6f} {error:9.6f} {trusted:11.6f} {its:9.6f} {apart:6.2f}")


def pulls() -> None:
    print(f"\n{'pulls over 20 seeds':32} {'variance':>9}")
    for name, forcing, parameters, start, steps, known in (
        (*LISTED[0][:4], 20_000, LISTED[0][5]),
        (*LISTED[3][:4], 2000, LISTED[3][5]),
    ):
        system: Any = strobe(name, forcing, parameters)
        found = [lyapunov(system, start, periods=steps, motions=32, transient=200, seed=seed) for seed in range(20)]
        squares = [(one.per_time[0] - known[0][0]) ** 2 / one.per_time_errors[0] ** 2 for one in found]
        print(f"{f'{name} {forcing} = {parameters[forcing]:g}':32} {np.mean(squares):9.2f}")


def basin(f: float = 0.418) -> None:
    x, v = np.linspace(-0.01, 0.01, 41) * (1.0 - 1e-12), np.linspace(-1.0, 1.0, 41)
    found = basins(strobe("hinge", "f", {"f": f}), x=x, v=v)
    orbits = [one.points[:, :2] for one in found.attractors]

    def label(i: int, k: int, steps: int) -> int:
        ends = hinge_strobes(x[i], v[k], 1000, f, steps)[0][-1]
        return int(np.argmin([np.abs(one - ends).max(axis=1).min() for one in orbits]))

    words = ["-".join(map(str, (one.period, *getattr(one, "began", ())))) for one in found.attractors]
    counts = ", ".join(f"{word} {int((found.labels == i).sum())}" for i, word in enumerate(words))
    print(f"\nbasin of the hinge at f = {f:g}: {counts}, undecided {found.undecided}")
    differ = [(i, k) for i in range(41) for k in range(41) if label(i, k, 150) != found.labels[i, k]]
    for steps in (150, 600, 2400):
        differ = [(i, k) for i, k in differ if label(i, k, steps) != found.labels[i, k]]
        print(f"  starts of another label by closed_forms with {steps} steps: {len(differ)}")


def cell() -> None:
    print("\nsupport at omega = 0.92, f0 = 0.66, from rest: distance of points 2 and 4 periods apart")
    for periods in (1000, 2000, 3000, 4000, 8000):
        points = [support_strobe(0.0, 0.0, periods + k, 0.05, 0.66, 300.0, 0.6, 1.6, 0.92)[:2] for k in (0, 2, 4)]
        two, four = (max(abs(a - b) for a, b in zip(points[0], one, strict=True)) for one in points[1:])
        print(f"  after {periods:5} periods: {two:.2e} {four:.2e}")


if __name__ == "__main__":
    exponents()
    pulls()
    basin()
    cell()
