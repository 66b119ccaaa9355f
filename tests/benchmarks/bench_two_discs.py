"""Bias, spread and coverage of the fits of two driving discs over many emulated benches.

Run:  python tests/benchmarks/bench_two_discs.py [--seeds 20] [--case together] [--estimator shooting]
Each seed is another bench (line errors, gain, phases) with other noise: the drive speeds of a case, 20 s each. Printed
in per cent of the truth (theta_s: in mrad): bias, spread over seeds, root mean square error, root mean square of the
stated standard deviation, share of 95 % intervals that hold the truth. J, k, c are those of the emulated rig.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from identification.fit.fit import fit_friction
from identification.fit.result import FrictionFit
from rig_io.bench.emulation import RIG, Disc, Emulation, MicroSlip
from rig_io.bench.emulator import emulate
from rig_io.bench.materials import material
from rig_io.logs.arrangement import CHANGEOVER, Arrangement
from rig_io.logs.log import StatedQuantity


@dataclass(frozen=True)
class Case:
    """Drive speeds (rad/s) of disc 0 and 1, one pair for each log, and what rubs. force: N; damping: N m s/rad."""

    pairs: tuple[tuple[float, float], ...]
    materials: tuple[str, str] = ("paper/rubber", "liner/rubber")
    arrangement: Arrangement = "together"
    changeover: float = 0.0
    force: float = 4.905
    damping: float = 0.055
    start: float = 0.0

    def logs(self, seed: int, stiffness: float) -> list:
        """Logs of the bench of one seed."""
        force = StatedQuantity(self.force, "N", 0.005)
        rig = replace(RIG, N0=force, N1=force, c=StatedQuantity(self.damping, "N*m*s/rad", 0.001))
        settings = [
            Emulation(
                f"log{number}",
                discs=tuple(Disc(material(name), w) for name, w in zip(self.materials, pair, strict=True)),
                rig=rig,
                arrangement=self.arrangement,
                changeover=self.changeover,
                start_angle=self.start,
                micro_slip=MicroSlip(stiffness) if stiffness else None,
            )
            for number, pair in enumerate(self.pairs)
        ]
        return [emulate(one, seed, number) for number, one in enumerate(settings)]

    @property
    def truth(self) -> dict[str, float]:
        """Parameters by name."""
        discs = [material(name) for name in self.materials]
        values = {f"{name}{i}": disc.values[name] for i, disc in enumerate(discs) for name in ("mu_s", "mu_k", "p")}
        return values | {name: self.changeover for key, name in CHANGEOVER.items() if key == self.arrangement}


LINER = ("liner/rubber", "liner/rubber")
CASES = {
    # stick on one disc or the other, and discs that turn against one another
    "together": Case(((0.83, 0.41), (0.41, 0.83), (1.5, -0.5))),
    "together-four": Case(((0.83, 0.2), (0.2, 0.83), (1.5, -0.5), (2.0, 0.41))),
    # one log of the disc_rig paper's class c that sticks on both discs
    "sequential-paper": Case(((0.9, 1.15),), LINER, "sequential", 0.0, 3.0, 0.0055, 0.14),
    "sequential": Case(((0.9, 1.15), (0.5, 1.15), (0.6, 0.9)), LINER, "sequential", 0.068914, 5.5),
    "sequential-mixed": Case(
        ((0.9, 1.15), (0.5, 1.15), (0.6, 0.9)), ("liner/rubber", "paper/rubber"), "sequential", 0.07
    ),
}


def fitted(seed: int, case: str, estimator: str, stiffness: float) -> FrictionFit:
    """The fit on the bench of one seed."""
    return fit_friction(CASES[case].logs(seed, stiffness), estimator=estimator)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=1000)
    parser.add_argument("--case", default="together", choices=CASES)
    parser.add_argument("--estimator", default="shooting")
    parser.add_argument("--micro-slip", type=float, default=0.0, help="contact stiffness, N/m (0: rigid)")
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    run = partial(fitted, case=asked.case, estimator=asked.estimator, stiffness=asked.micro_slip)
    with ProcessPoolExecutor(asked.workers) as workers:
        fits = list(workers.map(run, range(asked.first_seed, asked.first_seed + asked.seeds)))
    print(f"{asked.case}, {asked.estimator}, {asked.seeds} benches")
    for name, truth in CASES[asked.case].truth.items():
        scale = 1e-3 if name in CHANGEOVER.values() else 0.01 * truth
        error = np.array([fit[name].value - truth for fit in fits]) / scale
        stated = np.array([fit[name].standard_deviation for fit in fits]) / scale
        held = np.mean([low <= truth <= high for low, high in (fit.interval(name) for fit in fits)])
        rmse, said = (float(np.sqrt(np.mean(one**2))) for one in (error, stated))
        print(
            f"  {name:8s} bias {error.mean():+8.3f}   spread {error.std(ddof=1):7.3f}   rmse {rmse:7.3f}   stated "
            f"{said:7.3f}   covered {100 * held:5.1f} %"
        )


if __name__ == "__main__":
    main()
