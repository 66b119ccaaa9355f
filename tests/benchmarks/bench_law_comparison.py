"""How often a fit says that its model is wrong: where it is, and (false alarms) where it is not.

Run:  python tests/benchmarks/bench_law_comparison.py [--seeds 10] [--estimator weak-form]
Each seed is another bench with other noise, three drive speeds of 20 s each. Cases: right models of the three
materials; micro-slip (LuGre, 5e4 N/m) fitted by a rigid law; an exponential fall (and one with viscous
friction) fitted by Conti's law. Printed: share of seeds with a warning, and by which test.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from fmu_models.scene.read import read_scene
from fmu_models.scene.scene import Scene
from identification.fit.fit import DEFAULT, fit_friction
from identification.fit.result import FrictionFit
from rig_io.bench.emulator import STANDARD_SPEEDS, Disc, Emulation, MicroSlip, emulate, material
from rig_io.logs.log import RigLog


@dataclass(frozen=True)
class Case:
    """A truth: friction pair, stiffness of the contact (N/m; 0: rigid), and another law (lines of a scene) in place of
    the pair's; and whether the fit (Conti, rigid) is right for it."""

    name: str
    pair: str
    stiffness: float = 0.0
    law: str = ""
    right: bool = False


# the scenes keep mu_s and mu_k of the pair; v_s is of the size of 1/p
CASES = (
    Case("paper/rubber", "paper/rubber", right=True),
    Case("liner/rubber", "liner/rubber", right=True),
    Case("paper/paper", "paper/paper", right=True),
    Case("paper/rubber, micro-slip 5e4", "paper/rubber", stiffness=5e4),
    Case("liner/rubber, micro-slip 5e4", "liner/rubber", stiffness=5e4),
    Case("paper/rubber, exponential", "paper/rubber", law="tustin v_s0=0.04"),
    Case("paper/rubber, with viscous friction", "paper/rubber", law="conti_viscous mu_v0=0.2"),
)
TESTS = ("speeds", "course", "pre-sliding", "other")


def logs(case: Case, seed: int) -> list[RigLog]:
    """Stick-slip logs at the standard speeds, on the bench of one seed."""
    micro = MicroSlip(case.stiffness) if case.stiffness else None
    runs = []
    for number, speed in enumerate(STANDARD_SPEEDS[case.pair]):
        settings = Emulation(f"{speed:g}", (Disc(material(case.pair), speed),), micro_slip=micro)
        if case.law:
            settings = replace(settings, scene=_scene(case))
        runs.append(emulate(settings, seed, number))
    return runs


def _scene(case: Case) -> Scene:
    """The rig with one disc under the law of the case."""
    pair, (law, value) = material(case.pair).values, case.law.split()
    name, number = value.split("=")
    text = f"""title = "{case.name}"
model = "disc_rig"
contacts = ["disc0"]
stop_time = 25
laws = {{ disc0 = "{law}" }}
parameters = {{ mu_s0 = {pair["mu_s"]}, mu_k0 = {pair["mu_k"]}{f", p0 = {pair['p']}" if "conti" in law else ""} }}
free = {{ {name} = {number} }}
drives = {{ w0 = 0.41 }}
compute = {{ kind = "trajectory" }}
"""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "case.toml"
        path.write_text(text, encoding="utf-8")
        return read_scene(str(path))


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


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=2000)
    parser.add_argument("--estimator", default=DEFAULT)
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    seeds = range(asked.first_seed, asked.first_seed + asked.seeds)
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
