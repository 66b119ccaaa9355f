"""Bias, spread, coverage and efficiency of the friction estimators over many emulated benches.

Run:  python tests/benchmarks/bench_fit_statistics.py [--seeds 50] [--material paper/rubber] [--micro-slip 5e4]
Each seed is another bench (line errors, gain, phases) with other noise: three drive speeds of 20 s each. Printed in
per cent of the truth: bias, spread over seeds, root mean square error, root mean square of the stated standard
deviation and of the estimator's own bound of Cramer and Rao (where it states one), the error over that bound, share of
95 % intervals that hold the truth. By default J, k, c are those of the emulated rig; with --free-decay k/J and c/J come
from a decay log; with --known-gain the laser has no gain error, and no encoder is needed to find it.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from identification.estimators import ESTIMATORS
from identification.fit.fit import fit_friction
from identification.fit.result import FrictionFit
from identification.measurement.pooling import pool
from rig_io.bench.emulation import RIG, MicroSlip
from rig_io.bench.emulator import emulate, standard_set
from rig_io.bench.materials import material
from rig_io.logs.log import RigConstants
from rig_io.sensors.laser import Laser

NAMES = ("mu_s", "mu_k", "p")


@dataclass(frozen=True)
class Statistics:
    """Over seeds, for each parameter, (m,): bias, spread, error (root mean square), stated deviation and bound in per
    cent of the truth (bound: NaN where none is stated); coverage, 0 to 1."""

    bias: np.ndarray
    spread: np.ndarray
    error: np.ndarray
    stated: np.ndarray
    bound: np.ndarray
    coverage: np.ndarray
    seeds: int

    def __str__(self) -> str:
        rows = zip(NAMES, self.bias, self.spread, self.error, self.stated, self.bound, self.coverage, strict=True)
        return "\n".join(
            f"  {name:5s} bias {b:+8.4f} %   spread {s:7.4f} %   rmse {e:7.4f} %   stated {t:7.4f} %"
            f"   bound {k:7.4f} %   rmse/bound {e / k:5.2f}   covered {100 * c:5.1f} %"
            for name, b, s, e, t, k, c in rows
        )


def fits(
    seed: int,
    pair: str,
    estimators: Sequence[str],
    use_decay: bool = False,
    stiffness: float = 0.0,
    known_gain: bool = False,
) -> list[FrictionFit]:
    """Results (one for each estimator) on the bench of one seed."""
    instruments = {"laser": Laser(gain_error=0.0), "encoder": None} if known_gain else {}
    # true and held: what is judged is the noise (bench_coverage.py draws and adjusts them)
    true = {name: replace(one, standard_uncertainty=None) for name, one in vars(RIG).items()}
    settings = standard_set(
        pair, rig=RigConstants(**true), micro_slip=MicroSlip(stiffness) if stiffness else None, **instruments
    )
    logs = [emulate(one, seed, number) for number, one in enumerate(settings)]
    ready = pool(logs if use_decay else [log for log in logs if log.kind != "free-decay"])
    return [fit_friction(ready, estimator=name) for name in estimators]


def summary(results: Sequence[FrictionFit], pair: str) -> Statistics:
    """Statistics of one estimator's results against the truth."""
    truth = material(pair)
    expected = np.array(list(truth.values.values()))
    error = np.array([[fit[name].value for name in NAMES] for fit in results]) / expected - 1
    stated = np.array([[fit[name].standard_deviation for name in NAMES] for fit in results]) / expected
    bound = np.array([[fit[name].bound or np.nan for name in NAMES] for fit in results]) / expected
    held = [
        [low <= value <= high for (low, high), value in zip((fit.interval(n) for n in NAMES), expected, strict=True)]
        for fit in results
    ]
    return Statistics(
        100 * error.mean(axis=0),
        100 * error.std(axis=0, ddof=1),
        100 * np.sqrt(np.mean(error**2, axis=0)),
        100 * np.sqrt(np.mean(stated**2, axis=0)),
        100 * np.sqrt(np.mean(bound**2, axis=0)),
        np.mean(held, axis=0),
        len(results),
    )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=50)
    parser.add_argument("--first-seed", type=int, default=1000)
    parser.add_argument("--material", default="paper/rubber")
    parser.add_argument("--estimators", default=",".join(ESTIMATORS.members()), help="with commas; default: all")
    parser.add_argument("--micro-slip", type=float, default=0.0, help="contact stiffness, N/m (0: rigid)")
    parser.add_argument("--free-decay", action="store_true", help="k/J and c/J from a free decay")
    parser.add_argument("--known-gain", action="store_true", help="a laser without gain error, no encoder")
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    names = asked.estimators.split(",")
    run = partial(
        fits,
        pair=asked.material,
        estimators=names,
        use_decay=asked.free_decay,
        stiffness=asked.micro_slip,
        known_gain=asked.known_gain,
    )
    with ProcessPoolExecutor(asked.workers) as workers:
        results = list(workers.map(run, range(asked.first_seed, asked.first_seed + asked.seeds)))
    print(f"{asked.material}, {asked.seeds} benches, contact {'rigid' if not asked.micro_slip else asked.micro_slip}")
    for place, name in enumerate(names):
        used = sorted({result[place].estimator for result in results})
        print(name if used == [name] else f"{name} ({', '.join(used)})")
        print(summary([result[place] for result in results], asked.material))


if __name__ == "__main__":
    main()
