"""How often the parameters of laws of real contacts lie where a fit says, and how often ageing is seen.

Run:  python tests/benchmarks/bench_real_laws.py [--seeds 20] [--case stribeck]
Each seed is another bench with other noise and other rig constants within their uncertainties. Cases: Stribeck's curve
with viscous friction; friction by direction, drives either way; breakaway that ages by 0.02 or 0.01 a decade, or not at
all, without holds; that ages by 0.02, with a log of holds over two decades. Printed: largest |error| over deviation by
parameter, the share of parameters within two deviations, how often ageing is seen, and the error of b.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from identification.fit.fit import fit_friction
from identification.measurement.pooling import pool
from rig_io.bench.drive import Ripple, held_duration
from rig_io.bench.emulation import RIG, Disc, Emulation
from rig_io.bench.emulator import emulate, free_decay
from rig_io.bench.materials import Material
from rig_io.logs.log import StatedQuantity

FORWARD = (0.41, 0.83, 1.4)
HOLDS = (0.3, 3.0, 30.0, 1.0, 10.0, 30.0)
SMOOTH = Ripple(smoothing=0.02)
CONTI = {"mu_s": 0.65, "mu_k": 0.35, "p": 15.0}


@dataclass(frozen=True)
class Case:
    """A law and its values, the drive speeds, and holds."""

    law: str
    values: Mapping[str, float]
    speeds: tuple[float, ...] = FORWARD
    holds: tuple[float, ...] = ()


CASES = {
    "stribeck": Case("stribeck", {"mu_s": 0.65, "mu_k": 0.35, "v_s": 0.06, "mu_v": 0.3}),
    "directional": Case(
        "directional",
        {"mu_s_plus": 0.65, "mu_k_plus": 0.35, "p_plus": 15.0, "mu_s_minus": 0.5, "mu_k_minus": 0.3, "p_minus": 20.0},
        (0.41, 0.83, 1.4, -0.41, -0.83, -1.4),
    ),
    "no ageing": Case("ageing", {**CONTI, "b": 0.0}),
    "ageing 0.01": Case("ageing", {**CONTI, "b": 0.01}),
    "ageing 0.02": Case("ageing", {**CONTI, "b": 0.02}),
    "ageing 0.02, holds": Case("ageing", {**CONTI, "b": 0.02}, holds=HOLDS),
}


@dataclass(frozen=True)
class Outcome:
    """Of one seed: error over deviation by parameter; whether ageing was seen; relative error of its growth."""

    z: Mapping[str, float]
    ages: bool | None
    growth: float | None


def outcome(task: tuple[str, int]) -> Outcome:
    """One bench, fitted with its own law."""
    name, seed = task
    case = CASES[name]
    rng = np.random.default_rng([11, seed])

    def drawn(one: StatedQuantity) -> StatedQuantity:
        return replace(one, value=one.value + (one.standard_uncertainty or 0.0) * float(rng.standard_normal()))

    # the logs state the constants, the bench has others
    true = replace(RIG, **{key: drawn(getattr(RIG, key)) for key in ("J", "k", "c", "R", "r", "N0")})
    material = Material("truth", case.values, law=case.law)
    common = {"rig": true, "ripple": SMOOTH}
    runs = [Emulation(f"{w:g}", (Disc(material, w),), **common) for w in case.speeds]
    if case.holds:
        disc = (Disc(material, 0.41),)
        runs.append(Emulation("holds", disc, duration=held_duration(case.holds), holds=case.holds, **common))
    logs = [emulate(one, seed, number) for number, one in enumerate([*runs, free_decay(**common)])]
    logs = [replace(log, rig=replace(RIG, N1=log.rig.N1)) for log in logs]
    fit = fit_friction(pool(logs, allow_no_stick=True), law=case.law)
    z = {one.name: (one.value - case.values[one.name]) / one.total_deviation for one in fit.parameters}
    seen = fit.breakaway
    growth = None if seen is None or seen.growth is None else seen.growth / (case.values.get("b") or np.nan) - 1
    return Outcome(z, None if seen is None else seen.ages, growth)


def main() -> None:
    """Print a line per case."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--case", choices=CASES)
    asked = parser.parse_args()
    with ProcessPoolExecutor() as workers:
        for name in [asked.case] if asked.case else CASES:
            found = list(workers.map(outcome, [(name, seed) for seed in range(asked.seeds)]))
            z = np.array([list(one.z.values()) for one in found])
            worst = ", ".join(
                f"{key} {value:.2g}" for key, value in zip(found[0].z, np.abs(z).max(axis=0), strict=True)
            )
            print(f"{name}: within 2 sd {100 * np.mean(np.abs(z) < 2):.0f} % of {z.size}; largest |z| {worst}")
            ages = sum(bool(one.ages) for one in found)
            growth = [one.growth for one in found if one.growth is not None]
            print(f"    ageing seen in {ages} of {len(found)}", end="")
            if growth:
                off = 100 * np.abs(growth)
                print(f"; error of b {np.median(off):.1f} % (median), {np.max(off):.1f} % (most)", end="")
            print()


if __name__ == "__main__":
    main()
