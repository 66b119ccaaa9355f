"""How often a fit says that its model is wrong, and whether the right law comes first.

Run:  python tests/benchmarks/bench_law_comparison.py [--seeds 10] [--estimator weak-form]
      python tests/benchmarks/bench_law_comparison.py --laws [--truths Conti,Tustin] [--once 0.005]
Each seed is another bench with other noise, three drive speeds of 20 s each. Cases: right models of the three
materials; micro-slip (LuGre, 5e4 N/m) fitted by a rigid law; an exponential fall (and one with viscous
friction) fitted by Conti's law. Printed: share of seeds with a warning, and by which test. With --laws: for every
truth the share of seeds on which it comes first among all laws (or one that nests it, with what this has more within
three deviations of nothing; LuGre: the contact is said to give way and bristles come before the rigid contact), on
which another is called likely or sure, on which the default fit (Conti's law, with noise and the spread over laws; rig
constants are true) holds mu at zero slip speed, and CPU times over that of the plain fit. --once: of the normal force.
"""

from __future__ import annotations

import argparse
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from identification.fit.fit import fit_friction
from identification.fit.result import FrictionFit
from identification.inference.defaults import ESTIMATOR
from identification.laws import find_law
from identification.measurement.pooling import pool
from identification.next_step.laws import compare_contacts, compare_laws
from rig_io.bench.disturbances import Disturbances
from rig_io.bench.drive import Ripple
from rig_io.bench.emulation import Disc, Emulation, MicroSlip
from rig_io.bench.emulator import emulate
from rig_io.bench.materials import STANDARD_SPEEDS, Material, material
from rig_io.logs.log import RigLog


@dataclass(frozen=True)
class Case:
    """A truth: friction pair, stiffness of the contact (N/m; 0: rigid), and whether the fit (Conti, rigid) is right for
    it."""

    name: str
    pair: Material
    stiffness: float = 0.0
    right: bool = False


RUBBER = material("paper/rubber")
AS_RUBBER = {"mu_s": 0.65, "mu_k": 0.35}
# v_s is of the size of 1/p
CASES = (
    Case("paper/rubber", RUBBER, right=True),
    Case("liner/rubber", material("liner/rubber"), right=True),
    Case("paper/paper", material("paper/paper"), right=True),
    Case("paper/rubber, micro-slip 5e4", RUBBER, stiffness=5e4),
    Case("liner/rubber, micro-slip 5e4", material("liner/rubber"), stiffness=5e4),
    Case("paper/rubber, exponential", Material("paper/rubber", AS_RUBBER | {"v_s": 0.04}, "tustin")),
    Case(
        "paper/rubber, with viscous friction",
        Material("paper/rubber", AS_RUBBER | {"p": 15.0, "mu_v": 0.2}, "conti_viscous"),
    ),
)
TRUTHS = {
    "Conti": Case("Conti", RUBBER),
    "Conti+viscous": Case("Conti+viscous", CASES[-1].pair),
    "Stribeck+viscous": Case(
        "Stribeck+viscous", Material("paper/rubber", AS_RUBBER | {"v_s": 0.1, "mu_v": 0.2}, "stribeck")
    ),
    "Tustin": Case("Tustin", Material("paper/rubber", AS_RUBBER | {"v_s": 0.08}, "tustin")),
    "Coulomb+viscous": Case("Coulomb+viscous", Material("paper/rubber", {"mu": 0.5, "mu_v": 0.2}, "coulomb_viscous")),
    "LuGre": Case("LuGre", RUBBER, stiffness=5e4),
}
NESTED = {("Conti", "Conti+viscous"), ("Coulomb", "Coulomb+viscous")}
TESTS = ("speeds", "course", "pre-sliding", "other")


def logs(case: Case, seed: int, once: float = 0.0) -> list[RigLog]:
    """Stick-slip logs at the standard speeds, on the bench of one seed. once: amplitude of the normal force."""
    micro = MicroSlip(case.stiffness) if case.stiffness else None
    runs = []
    for number, speed in enumerate(STANDARD_SPEEDS[case.pair.name]):
        settings = Emulation(f"{speed:g}", (Disc(case.pair, speed),), micro_slip=micro)
        if case.pair.law == "coulomb_viscous":  # nothing drives a cycle: the disc is let go and comes to rest
            settings = replace(settings, transient=0.0, start_angle=-0.4, duration=8.0)
        if once:
            disturbances = Disturbances(once=once)
            settings = replace(settings, disturbances=disturbances, ripple=Ripple(smoothing=0.02))
        runs.append(emulate(settings, seed, number))
    return runs


def flagged(fit: FrictionFit) -> dict[str, bool]:
    """Which tests say that the model is wrong."""
    assert fit.whiteness is not None
    warnings = (*fit.whiteness.warnings, *(fit.presliding.warnings if fit.presliding else ()))
    own = (*warnings, *(fit.collinearity.warnings if fit.collinearity else ()))
    return {
        "speeds": bool(fit.whiteness.beyond),
        "course": bool(fit.whiteness.repeated),
        "pre-sliding": bool(fit.presliding and fit.presliding.elastic),
        # of the law itself: rising friction, a bound that is reached
        "other": any(said not in own and ("less than mu_k" in said or "bound of" in said) for said in fit.warnings),
    }


def one(seed: int, case: Case, estimator: str) -> dict[str, bool]:
    """Tests of the fit to one bench."""
    return flagged(fit_friction(logs(case, seed), estimator=estimator))


@dataclass(frozen=True)
class Judged:
    """One bench. first: whether the right law comes first; wrong: whether another is called likely or sure; held:
    whether the default fit holds the friction at zero slip speed; cost: CPU time of `laws` and of the default fit, over
    that of the plain fit."""

    first: bool
    wrong: bool
    held: bool
    cost: tuple[float, float]


def judged(seed: int, truth: str, once: float, disturbances: str) -> Judged:
    """The laws on the bench of one seed."""
    ready = pool(logs(TRUTHS[truth], seed, once), allow_no_stick=truth == "Coulomb+viscous")
    marks = [time.process_time()]
    fit_friction(ready)
    marks.append(time.process_time())
    found = compare_laws(ready, disturbances=disturbances)
    marks.append(time.process_time())
    fit = fit_friction(ready, disturbances=disturbances, law_spread="auto")
    marks.append(time.process_time())
    best = found.best
    first = best.law == truth
    if (truth, best.law) in NESTED:
        first = all(
            abs(best.values[name]) < 3 * best.deviations[name] for name in best.values if name not in AS_NESTED[truth]
        )
    if truth == "LuGre":
        first = found.elastic and compare_contacts(ready).best.law == "LuGre"
    sure = "Sure" in found.verdict or "Likely" in found.verdict
    values = TRUTHS[truth].pair.values
    at_rest = fit["mu_s"]
    reach = 2 * np.hypot(at_rest.standard_deviation, at_rest.law_deviation or 0.0)
    held = abs(at_rest.value - values.get("mu_s", values.get("mu", 0.0))) < reach
    plain, laws, default = np.diff(marks)
    wrong = sure and best.law != truth and (truth, best.law) not in NESTED
    return Judged(first, wrong, bool(held), (laws / plain, default / plain))


AS_NESTED = {less: {*find_law(less).names, "gain", "delay"} for less, _ in NESTED}


def compare_truths(asked: argparse.Namespace, seeds: range) -> None:
    """A line for each truth."""
    print(f"laws by shooting, {asked.seeds} benches, N once per turn {asked.once:g}, disturbances {asked.disturbances}")
    with ProcessPoolExecutor(asked.workers) as workers:
        for truth in asked.truths.split(","):
            one = partial(judged, truth=truth, once=asked.once, disturbances=asked.disturbances)
            found = list(workers.map(one, seeds))
            first, wrong, held = (sum(getattr(one, key) for one in found) for key in ("first", "wrong", "held"))
            laws, default = np.median([one.cost for one in found], axis=0)
            print(
                f"  {truth:18s} first {first:2d} of {len(found)}   wrong and likely {wrong:2d}   mu(0) held {held:2d}"
                f"   CPU, laws {laws:.1f}, default fit {default:.1f}",
                flush=True,
            )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=2000)
    parser.add_argument("--estimator", default=ESTIMATOR)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--laws", action="store_true")
    parser.add_argument("--truths", default=",".join(TRUTHS))
    parser.add_argument("--once", type=float, default=0.0)
    parser.add_argument("--disturbances", default="auto")
    asked = parser.parse_args()
    seeds = range(asked.first_seed, asked.first_seed + asked.seeds)
    if asked.laws:
        compare_truths(asked, seeds)
        return
    print(f"{asked.estimator}, {asked.seeds} benches: share of fits that say that the model is wrong")
    with ProcessPoolExecutor(asked.workers) as workers:
        for case in CASES:
            found = list(workers.map(partial(one, case=case, estimator=asked.estimator), seeds))
            said = sum(any(tests.values()) for tests in found)
            by = ", ".join(f"{name} {sum(tests[name] for tests in found)}" for name in TESTS)
            truth = "right" if case.right else "wrong"
            print(f"  {case.name:38s} {truth}  {said:3d} of {len(found)}   ({by})", flush=True)


if __name__ == "__main__":
    main()
