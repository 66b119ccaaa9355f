"""How often the 95 % intervals hold the truth when rig constants are off as their uncertainties say.

Run:  python tests/benchmarks/bench_coverage.py [--seeds 100] [--cells paper/rubber,together] [--estimators shooting]
          [--free-decay] [--gross J=0.05] [--micro-slip 5e4] [--rig encoder]
Each seed is another bench (line errors, gain, phases, noise) whose stated constants are drawn around the true ones. A
cell is a friction pair under one disc (three drive speeds of 20 s) or a case of two discs. Printed for each cell and
estimator: by parameter in how many of the benches the combined interval holds the truth, with the binomial deviation;
root mean square of error over combined deviation; median combined deviation in per cent; on how many benches constants
were said to contradict each other, and how many were refused. With --gross a stated constant is off by that share. With
--rig it is one with other instruments (one disc).
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from bench_two_discs import CASES

from fmu_models.base.errors import StickslipError
from identification.fit.fit import fit_friction
from identification.measurement.pooling import pool
from rig_io.bench.disturbances import Disturbances
from rig_io.bench.emulation import RIG, MicroSlip
from rig_io.bench.emulator import emulate, standard_set
from rig_io.bench.materials import MATERIALS, material
from rig_io.logs.log import RigLog
from rig_io.sensors.load_cell import LoadCell
from rig_io.sensors.speed_sensor import SPEED_SENSORS

RIGS: Mapping[str, Mapping[str, Any]] = {
    "whole": {},
    "encoder": {"laser": None},
    "laser": {"encoder": None},
    "nominal": {"drive_encoder": None, "speed_deviation": 0.005},
    "tachometer": {"speed_sensor": SPEED_SENSORS["tachometer"]},
    "vibrometer": {"speed_sensor": SPEED_SENSORS["vibrometer"]},
    "load cell": {"load_cell": LoadCell(), "disturbances": Disturbances(once=0.05)},
    "least": {"laser": None, "drive_encoder": None, "speed_deviation": 0.005},
}
CONSTANTS = ("J", "k", "c", "R", "r", "N0", "N1")


@dataclass(frozen=True)
class Bench:
    """One fit: by parameter (m,) error over truth, combined deviation over truth, whether the interval holds it;
    contradicted: whether constants contradict each other."""

    error: np.ndarray
    deviation: np.ndarray
    held: np.ndarray
    contradicted: bool


def logs_of(cell: str, seed: int, stiffness: float, decay: bool, rig: str) -> tuple[list[RigLog], dict[str, float]]:
    """Logs of a bench, and the true parameters."""
    if cell in MATERIALS:
        settings = standard_set(cell, micro_slip=MicroSlip(stiffness) if stiffness else None, **RIGS[rig])
        settings = settings if decay else settings[:-1]
        logs = [emulate(one, seed, number) for number, one in enumerate(settings)]
        return logs, dict(material(cell).values)
    return CASES[cell].logs(seed, stiffness), CASES[cell].truth


def drawn(logs: list[RigLog], seed: int, gross: Mapping[str, float]) -> list[RigLog]:
    """The logs with stated constants off as their uncertainties say, one set for all, and ``gross`` errors on top."""
    random = np.random.default_rng([seed, 7])
    off = dict(zip(CONSTANTS, random.standard_normal(len(CONSTANTS)), strict=True))
    rig = logs[0].rig
    stated = {}
    for name in CONSTANTS:
        if (one := getattr(rig, name)) is not None:
            sd = one.standard_uncertainty or getattr(RIG, name).standard_uncertainty
            value = (one.value + sd * off[name]) * (1 + gross.get(name, 0.0))
            stated[name] = replace(one, value=value, standard_uncertainty=sd)
    return [replace(log, rig=replace(log.rig, **stated)) for log in logs]


def fits(cell: str, seed: int, asked: argparse.Namespace, gross: Mapping[str, float]) -> dict[str, Bench | str]:
    """By estimator, what came of the bench of one seed; of a refusal its words."""
    logs, truth = logs_of(cell, seed, asked.micro_slip, asked.free_decay, asked.rig)
    expected = np.array(list(truth.values()))
    found: dict[str, Bench | str] = {}
    try:
        ready = pool(drawn(logs, seed, gross))
    except StickslipError as error:
        return dict.fromkeys(asked.estimators.split(","), str(error))
    for name in asked.estimators.split(","):
        try:
            fit = fit_friction(ready, estimator=name)
        except StickslipError as error:
            found[name] = str(error)
            continue
        ends = np.array([fit.interval(one) for one in truth])
        error = np.array([fit[one].value for one in truth]) / expected - 1
        deviation = np.array([fit[one].total_deviation for one in truth]) / np.abs(expected)
        held = (ends[:, 0] <= expected) & (expected <= ends[:, 1])
        found[name] = Bench(error, deviation, held, bool(fit.contradictions))
    return found


def line(found: list[Bench | str]) -> str:
    """What the seeds say."""
    fitted = [one for one in found if isinstance(one, Bench)]
    refused = f"refused {len(found) - len(fitted)} of {len(found)}"
    if not fitted:
        return refused
    share = np.mean([one.held for one in fitted], axis=0)
    spread = np.sqrt(np.maximum(share * (1 - share), 0.05 * 0.95) / len(fitted))
    z = np.sqrt(np.mean([(one.error / one.deviation) ** 2 for one in fitted], axis=0))
    sd = 100 * np.median([one.deviation for one in fitted], axis=0)
    bias = 100 * np.mean([one.error for one in fitted], axis=0)
    columns = [
        f"{100 * s:3.0f} ± {100 * e:.0f} % (rms z {r:.2f}, sd {d:.2g} %, bias {b:+.2g} %)"
        for s, e, r, d, b in zip(share, spread, z, sd, bias, strict=True)
    ]
    contradicted = sum(one.contradicted for one in fitted)
    return "; ".join(columns) + f"; contradicted {contradicted}, {refused}"


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--first-seed", type=int, default=5000)
    parser.add_argument("--cells", default=",".join(MATERIALS), help=f"with commas: {', '.join((*MATERIALS, *CASES))}")
    parser.add_argument("--estimators", default="shooting", help="with commas")
    parser.add_argument("--free-decay", action="store_true", help="k/J and c/J from a free decay (one disc)")
    parser.add_argument("--gross", action="append", default=[], metavar="NAME=SHARE")
    parser.add_argument("--micro-slip", type=float, default=0.0, help="contact stiffness, N/m (0: rigid)")
    parser.add_argument("--rig", choices=RIGS, default="whole")
    asked = parser.parse_args()
    gross = {name: float(share) for name, share in (one.split("=") for one in asked.gross)}
    for cell in asked.cells.split(","):
        found: dict[str, list[Bench | str]] = defaultdict(list)
        for seed in range(asked.first_seed, asked.first_seed + asked.seeds):
            for name, one in fits(cell, seed, asked, gross).items():
                found[name].append(one)
        for name, benches in found.items():
            print(f"{cell:16s} {name:15s} {line(benches)}", flush=True)


if __name__ == "__main__":
    main()
