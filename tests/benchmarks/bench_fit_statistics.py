"""Bias, spread and coverage of the friction estimators over many emulated benches.

Run:  python tests/benchmarks/bench_fit_statistics.py [--seeds 50] [--material paper/rubber] [--micro-slip 5e4]
Each seed is another bench (line errors, gain, phases) with other noise: three drive speeds of 20 s each. Printed in
per cent of the truth: bias, spread over seeds, root mean square of the stated standard deviation, share of 95 %
intervals that hold the truth. By default J, k, c are those of the emulated rig; with --free-decay k/J and c/J come
from a decay log.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np

from identification.estimators import ESTIMATORS, fit_friction
from identification.pooling import pool
from rig_io.emulator import MicroSlip, emulate, material, standard_set


@dataclass(frozen=True)
class Statistics:
    """Over seeds, for each parameter, (m,): bias, spread, stated deviation in per cent of the truth; coverage, 0 to
    1."""

    names: tuple[str, ...]
    bias: np.ndarray
    spread: np.ndarray
    stated: np.ndarray
    coverage: np.ndarray
    seeds: int

    def __str__(self) -> str:
        return "\n".join(
            f"  {name:5s} bias {b:+7.3f} %   spread {s:6.3f} %   stated {t:6.3f} %   covered {100 * c:5.1f} %"
            for name, b, s, t, c in zip(self.names, self.bias, self.spread, self.stated, self.coverage, strict=True)
        )


def fits(seed: int, pair: str, estimators: Sequence[str], use_decay: bool = False, stiffness: float = 0.0) -> list:
    """Results (one for each estimator) on the bench of one seed."""
    settings = standard_set(pair, micro_slip=MicroSlip(stiffness) if stiffness else None)
    logs = [emulate(one, seed, number) for number, one in enumerate(settings)]
    ready = pool(logs if use_decay else [log for log in logs if log.kind != "free-decay"])
    return [fit_friction(ready, estimator=name) for name in estimators]


def summary(results: Sequence, pair: str) -> Statistics:
    """Statistics of one estimator's results against the truth."""
    truth = material(pair)
    expected = np.array([truth.mu_s, truth.mu_k, truth.p])
    names = ("mu_s", "mu_k", "p")
    error = np.array([fit.law_values for fit in results]) / expected - 1
    stated = np.array([[fit[name].standard_deviation for name in names] for fit in results]) / expected
    held = [
        [low <= value <= high for (low, high), value in zip((fit.interval(n) for n in names), expected, strict=True)]
        for fit in results
    ]
    return Statistics(
        names,
        100 * error.mean(axis=0),
        100 * error.std(axis=0, ddof=1),
        100 * np.sqrt(np.mean(stated**2, axis=0)),
        np.mean(held, axis=0),
        len(results),
    )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=50)
    parser.add_argument("--first-seed", type=int, default=1000)
    parser.add_argument("--material", default="paper/rubber")
    parser.add_argument("--micro-slip", type=float, default=0.0, help="contact stiffness, N/m (0: rigid)")
    parser.add_argument("--free-decay", action="store_true", help="k/J and c/J from a free decay")
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    run = partial(
        fits,
        pair=asked.material,
        estimators=tuple(ESTIMATORS),
        use_decay=asked.free_decay,
        stiffness=asked.micro_slip,
    )
    with ProcessPoolExecutor(asked.workers) as workers:
        results = list(workers.map(run, range(asked.first_seed, asked.first_seed + asked.seeds)))
    print(f"{asked.material}, {asked.seeds} benches, contact {'rigid' if not asked.micro_slip else asked.micro_slip}")
    for place, name in enumerate(ESTIMATORS):
        print(name)
        print(summary([result[place] for result in results], asked.material))


if __name__ == "__main__":
    main()
