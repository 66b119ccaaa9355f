"""Fits on benches with disturbances: what is found, and how far the corrected values are from the truth.

Run:  python tests/benchmarks/bench_disturbances.py [--seeds 20] [--material paper/rubber] [--estimator shooting]
Each seed is another bench: three logs of 20 s and a free decay, rig constants true. Printed for each disturbance, per
cent of the truth for mu_s, mu_k, p: median error of the plain fit and of the corrected one, bias, root mean square
error, that over the bound of Cramer and Rao, share of 95 % intervals that hold the truth; share of benches on which any
parameter is more than three combined deviations off, share of benches on which the
right cause is named first, and on which the set of causes is exact (clean: none); CPU time over that of the plain fit.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.disturbances.terms import terms_of
from identification.fit.fit import fit_friction
from identification.measurement.pooling import pool
from rig_io.bench.disturbances import Disturbances
from rig_io.bench.drive import Ripple
from rig_io.bench.emulator import emulate, standard_set
from rig_io.bench.materials import material

FORCE, ANGLE, WEAR = "normal-force", "angle", "wear"
NAMES = ("mu_s", "mu_k", "p")
SIX = Disturbances(once=0.005, angle=0.01, per_log=0.005, within=0.005, drift=5e-5, zero=5e-4, offset=2e-5)
CASES: Mapping[str, tuple[Disturbances, frozenset[str]]] = {
    "clean": (Disturbances(), frozenset()),
    "N 5 %": (Disturbances(once=0.05), frozenset({FORCE})),
    "N 0.5 %": (Disturbances(once=0.005), frozenset({FORCE})),
    "mu(angle) 5 %": (Disturbances(angle=0.05), frozenset({ANGLE})),
    "wear 4 % a log": (Disturbances(per_log=0.04, within=0.04), frozenset({WEAR})),
    "wear 1 % a log": (Disturbances(per_log=0.01, within=0.01), frozenset({WEAR})),
    "N + mu(angle) 2 %": (Disturbances(once=0.02, angle=0.02), frozenset({FORCE, ANGLE})),
    "N + wear 2 %": (Disturbances(once=0.02, per_log=0.02, within=0.02), frozenset({FORCE, WEAR})),
    "mu(angle) + wear 2 %": (Disturbances(angle=0.02, per_log=0.02, within=0.02), frozenset({ANGLE, WEAR})),
    "laser drift 0.3 mm": (Disturbances(drift=3e-4), frozenset()),
    "laser drift 0.1 mm": (Disturbances(drift=1e-4), frozenset()),
    "six mild": (SIX, frozenset({FORCE, ANGLE, WEAR})),
}


@dataclass(frozen=True)
class Bench:
    """One bench: errors (m,) of plain and corrected fit, bound and combined deviation (m,), all relative; held: (m,)
    whether the interval of the corrected one holds the truth; causes found; ratio of CPU times."""

    plain: np.ndarray
    error: np.ndarray
    bound: np.ndarray
    deviation: np.ndarray
    held: np.ndarray
    causes: tuple[str, ...]
    ratio: float


def bench(seed: int, pair: str, disturbances: Disturbances, estimator: str) -> Bench:
    """The fits on the bench of one seed."""
    settings = standard_set(pair, disturbances=disturbances, ripple=Ripple(smoothing=0.02))
    ready = pool([emulate(one, seed, number) for number, one in enumerate(settings)])
    begin = time.process_time()
    fit = fit_friction(ready, estimator=estimator, disturbances="auto")
    middle = time.process_time()
    try:
        fit_friction(ready, estimator=estimator)
        ratio = (middle - begin) / (time.process_time() - middle)
    except StickslipError:  # the plain model does not follow the logs at all
        ratio = np.nan
    truth = np.array(list(material(pair).values.values()))
    if ANGLE in [cause.name for cause in fit.causes]:
        truth[:2] *= 1 + disturbances.by_angle(np.array(terms_of(ready, [ANGLE])[0].reference))
    ends = np.array([fit.interval(name) for name in NAMES])
    return Bench(
        np.array([one.value for one in fit.plain or fit.parameters]) / truth - 1,
        fit.law_values / truth - 1,
        np.array([q.bound or np.nan for q in fit.parameters]) / truth,
        np.array([q.total_deviation for q in fit.parameters]) / truth,
        (ends[:, 0] <= truth) & (truth <= ends[:, 1]),
        tuple(cause.name for cause in fit.causes),
        ratio,
    )


def line(name: str, found: list[Bench], causes: frozenset[str]) -> str:
    """What the seeds of one disturbance say."""
    error, plain = (np.array([getattr(one, key) for one in found]) for key in ("error", "plain"))
    rmse = np.sqrt(np.mean(error**2, axis=0))
    bound = np.sqrt(np.mean(np.array([one.bound for one in found]) ** 2, axis=0))
    columns = {
        "before": 100 * np.median(np.abs(plain), axis=0),
        "after": 100 * np.median(np.abs(error), axis=0),
        "bias": 100 * error.mean(axis=0),
        "rmse": 100 * rmse,
        "rmse/bound": rmse / bound,
        "covered %": 100 * np.mean([one.held for one in found], axis=0),
    }
    shown = "  ".join(f"{key} {' '.join(f'{value:.2g}' for value in values)}" for key, values in columns.items())
    first = np.mean([bool(one.causes[:1]) and one.causes[0] in causes for one in found]) if causes else np.nan
    exact = np.mean([frozenset(one.causes) == causes for one in found])
    beyond = np.mean([np.max(np.abs(one.error) / one.deviation) > 3 for one in found])
    ratio = np.nanmedian([one.ratio for one in found])
    shown += f"  beyond 3 sd {100 * beyond:.0f} %"
    return f"{name:22s} {shown}  first {100 * first:.0f} %  exact {100 * exact:.0f} %  CPU {ratio:.2g}"


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=2000)
    parser.add_argument("--material", default="paper/rubber")
    parser.add_argument("--estimator", default="shooting")
    parser.add_argument("--cases", default=",".join(CASES), help="with commas; default: all")
    asked = parser.parse_args()
    for name in asked.cases.split(","):
        disturbances, causes = CASES[name.strip()]
        seeds = range(asked.first_seed, asked.first_seed + asked.seeds)
        found = [bench(seed, asked.material, disturbances, asked.estimator) for seed in seeds]
        print(line(name.strip(), found, causes), flush=True)


if __name__ == "__main__":
    main()
