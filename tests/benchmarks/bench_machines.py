"""How near to the truth base parameters of the emulated two-link arm come, and how often their intervals hold it.

Run:  python tests/benchmarks/bench_machines.py [--seeds 12] [--logs 3] [--cutoff 10] [--noise 0]
Each seed has logs of its own (encoder counts, noise and ripple of the torque; ``--noise``: rad, white on the positions
on top). Printed for instruments and for least squares: by base parameter bias (mean error) and root mean square error
in per cent of the truth, and in how many seeds value +- 1.96 deviations hold it; then the largest bias of inertia and
gravity (at most 1 % is asked), of friction (5 %), and the mean coverage (at least .85).
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))

from emulated_arm import ARM, log

from fmu_models.oscillators import load
from identification.machines.inverse import identify_machine
from identification.machines.motion import MachineLog
from identification.machines.regressor import base_parameters, regressor_of

MODEL = load(Path(__file__).parents[2] / "data" / "machines" / "two_link_arm.py")
KNOWN = {"g": ARM["g"], "l1": ARM["l1"]}
WITHIN = 1.96  # deviations


def logs_of(seed: int, count: int, noise: float) -> list[MachineLog]:
    """Logs of one seed, none of which another has."""
    rng = np.random.default_rng([seed, 3])
    found = [log(1000 + count * seed + number) for number in range(count)]
    return [replace(one, position=one.position + noise * rng.normal(size=one.position.shape)) for one in found]


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=12)
    parser.add_argument("--logs", type=int, default=3)
    parser.add_argument("--cutoff", type=float, default=10.0, help="Hz")
    parser.add_argument("--noise", type=float, default=0.0, help="rad, on the positions")
    asked = parser.parse_args()
    regressor = regressor_of(MODEL, KNOWN)
    base = base_parameters(regressor)
    truth = base.combine @ regressor.declared
    fits = [
        identify_machine(MODEL, logs_of(seed, asked.logs, asked.noise), known=KNOWN, cutoff=asked.cutoff)
        for seed in range(asked.seeds)
    ]
    frictional = np.array([one.frictional for one in base.parameters])
    both = {
        "instruments": ("value", "standard_deviation"),
        "least squares": ("least_squares", "least_squares_deviation"),
    }
    for method, names in both.items():
        values, deviations = (
            np.array([[getattr(one, name) for one in fit.parameters] for fit in fits]) for name in names
        )
        error = values / truth - 1
        held = np.abs(values - truth) <= WITHIN * deviations
        print(f"{method}, {asked.seeds} seeds of {asked.logs} logs, cutoff {asked.cutoff:g} Hz")
        for place, one in enumerate(base.parameters):
            bias, size = 100 * error[:, place].mean(), 100 * np.sqrt(np.mean(error[:, place] ** 2))
            print(f"  {one.combination:16s} bias {bias:+7.2f} %  rms {size:6.2f} %  held {held[:, place].mean():.2f}")
        bias = np.abs(error.mean(axis=0))
        inertial, dry = 100 * bias[~frictional].max(), 100 * bias[frictional].max()
        print(f"  largest bias: inertia and gravity {inertial:.2f} %, friction {dry:.2f} %; coverage {held.mean():.3f}")


if __name__ == "__main__":
    main()
