"""Blind logs: what a user makes of the CSV files of an unknown bench by `stickslip describe` and `stickslip fit`.

Run:  python tests/benchmarks/bench_blind_logs.py [--first 0] [--benches 60] [--workers 1] [--keep FOLDER]
Each bench has a Conti law of its own, three drive speeds and a free decay, and rig constants that differ from what is
stated as their uncertainties say. In turn: a laser that sees sine, arc or tangent; 250 to 2000 samples a second; counts
with or without the times of edges. A third is told another beam than there is; of the others some have a disturbance.
The fit sees the CSV files and the answers alone. Printed for each bench: whether the
first fit is right (mu_s, mu_k, p within three stated deviations), errors in deviations, what is named, what should be;
at last the shares, that of 95 % intervals which hold the truth, and the CPU time of a fit, median.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from identification import cli
from rig_io.bench.disturbances import Disturbances
from rig_io.bench.emulation import RIG, Disc, Emulation
from rig_io.bench.emulator import emulate, free_decay
from rig_io.bench.materials import Material
from rig_io.logs.beam import BEAMS
from rig_io.logs.log import RigConstants, RigLog, StatedQuantity
from rig_io.readers import csv_log
from rig_io.sensors.encoder import Encoder
from rig_io.sensors.laser import Laser

RATES = (250.0, 500.0, 1000.0, 2000.0)  # Hz
DURATION = 12.0  # s
SIZES: Mapping[str, Mapping[str, float]] = {  # by the name that is right
    "wear": {"within": 0.02},
    "normal-force": {"once": 0.01},
    "spring": {"spring": 0.5},
}
HEADS = {  # as a recorder has them
    "time": "t [s]",
    "laser": "Laser [V]",
    "encoder_count": "Encoder disc",
    "encoder_edge_time": "Encoder disc edge time [s]",
    "drive0_count": "Encoder drive",
    "drive0_edge_time": "Encoder drive edge time [s]",
}


@dataclass(frozen=True)
class Blind:
    """One bench, by its number: what there is, and what the user says of it."""

    number: int

    @property
    def turn(self) -> int:
        """Of what is done to benches of one beam."""
        return self.number // 3 + self.number // 12

    @property
    def beam(self) -> str:
        return tuple(BEAMS)[self.number % 3]

    @property
    def told(self) -> str:
        """The beam that the user says."""
        return tuple(BEAMS)[(self.number + self.turn % 2 + 1) % 3] if self.turn % 3 == 0 else self.beam

    @property
    def rate(self) -> float:
        return RATES[self.number // 3 % len(RATES)]

    @property
    def edge_times(self) -> bool:
        return self.turn % 2 == 0

    @property
    def disturbance(self) -> str:
        """Its name; nothing where there is none."""
        some = (*SIZES, "")
        return some[(self.number + self.turn // 3) % len(some)] if self.turn % 3 == 2 else ""

    def logs(self) -> tuple[list[RigLog], np.ndarray]:
        """What the bench records, and mu_s, mu_k, p."""
        rng = np.random.default_rng([39, self.number])
        mu_k, fall, p = rng.uniform([0.28, 0.18, 10.0], [0.42, 0.32, 20.0])
        law = Material("unknown", {"mu_s": mu_k + fall, "mu_k": mu_k, "p": p})
        speeds = np.round(np.exp(rng.uniform(np.log([0.35, 0.6, 0.9]), np.log([0.5, 0.8, 1.1]))), 3)
        how: dict[str, Any] = {
            "rig": RigConstants(**{name: _drawn(quantity, rng) for name, quantity in vars(RIG).items()}),
            "duration": DURATION,
            "sampling_rate": self.rate,
            "laser": Laser(beam=self.beam),
            "encoder": Encoder(),
        }
        if self.disturbance:
            how["disturbances"] = Disturbances(**SIZES[self.disturbance])
        runs = [Emulation(f"run{n}", discs=(Disc(law, float(w)),), **how) for n, w in enumerate(speeds, 1)]
        logs = [emulate(one, self.number, n) for n, one in enumerate([*runs, free_decay("decay", **how)])]
        return logs, np.array([mu_k + fall, mu_k, p])

    def answers(self) -> list[str]:
        """What is known of the bench, as options of `describe`."""
        names = ("J", "R", "r", "N0")
        said = [f"{name}={RIG.value(name)} ± {RIG.quantity(name).standard_uncertainty}" for name in names]
        said += ["laser=0.01 ± 0.00002 m/V, 5 V", "laser_noise=20 um", f"laser_beam={self.told}", "laser_latency=0 s"]
        said += ["encoder=1000", "drive0=1000"]
        return [word for one in said for word in ("--set", one)]


def _drawn(quantity: StatedQuantity, rng: np.random.Generator) -> StatedQuantity:
    return replace(quantity, value=quantity.value + (quantity.standard_uncertainty or 0.0) * rng.standard_normal())


def record(bench: Blind, folder: Path) -> np.ndarray:
    """Write the CSV files of a bench; mu_s, mu_k, p."""
    logs, truth = bench.logs()
    for log in logs:
        columns = {"time": log.time, **log.columns}
        if not bench.edge_times:
            columns = {name: column for name, column in columns.items() if not name.endswith("edge_time")}
        csv_log.write(folder / f"{log.name}.csv", {HEADS[name]: column for name, column in columns.items()})
    return truth


def stickslip(*words: object) -> tuple[int, str, str]:
    """Run the command: exit code, what it printed, and what it said on standard error."""
    out, err = io.StringIO(), io.StringIO()
    argv = mock.patch.object(sys, "argv", ["stickslip", *map(str, words)])
    with argv, contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            cli.main()
            code = 0
        except SystemExit as stopped:
            code = int(stopped.code or 0)
    return code, out.getvalue(), err.getvalue()


@dataclass(frozen=True)
class Outcome:
    """errors: of mu_s, mu_k, p in stated deviations, none where there is no fit; held: how many of their 95 % intervals
    hold the truth; named: what is said to be wrong; beam: that is said to be there, where it is said, or those that
    are not told apart; cpu: s."""

    bench: Blind
    errors: tuple[float, ...]
    held: int
    named: tuple[str, ...]
    beam: str
    cpu: float
    said: str

    @property
    def right(self) -> bool:
        """Whether the first fit is."""
        return bool(self.errors) and max(map(abs, self.errors)) < 3

    @property
    def false(self) -> bool:
        """Whether something is named that is not there."""
        bench = self.bench
        there = {bench.disturbance} | ({"laser-bend"} if bench.told != bench.beam else set())
        return any(set(one.split("/")).isdisjoint(there) for one in self.named) or (self.beam != "" and not self.seen)

    @property
    def seen(self) -> bool:
        """Whether the beam that is there is among those named."""
        return self.bench.beam in self.beam.split(" or ")


def judged(bench: Blind, folder: Path) -> Outcome:
    """Describe and fit the logs in a folder, which are written there if it is empty."""
    folder.mkdir(parents=True, exist_ok=True)
    kept = folder.with_suffix(".truth.json")
    if not kept.exists():
        kept.write_text(json.dumps(record(bench, folder).tolist()))
    truth = np.array(json.loads(kept.read_text()))
    code, out, err = stickslip("describe", folder, *bench.answers(), "--confirm", "--json")
    if code or not json.loads(out)["complete"]:
        return Outcome(bench, (), 0, ("describe",), "", 0.0, out + err)
    begin = time.process_time()
    code, out, err = stickslip("fit", folder, "--json")
    cpu = time.process_time() - begin
    beams = {name for name in BEAMS if f"laser_beam={name}" in " ".join((out + err).replace("'", "").split())}
    beam = " or ".join(sorted(beams))
    if code:
        return Outcome(bench, (), 0, () if beam else ("refused",), beam, cpu, err)
    fit = json.loads(out)
    folder.with_suffix(".fit.json").write_text(out)
    parameters = fit["parameters"]
    deviations = [np.hypot(np.hypot(q["sd_noise"], q["sd_rig_constants"]), q["sd_law"] or 0) for q in parameters]
    errors = (np.array([q["value"] for q in parameters]) - truth) / deviations
    held = sum(q["low"] <= true <= q["high"] for q, true in zip(parameters, truth, strict=True))
    named = ["/".join((cause["name"], *cause["alike"])) for cause in fit["causes"]]
    named += ["contradiction"] if fit["contradictions"] else []
    named += ["unexplained"] if fit["free"] and fit["free"]["unexplained"] > 0 else []
    said = " | ".join(fit["warnings"])
    named += ["form"] if "The law misses the data" in said else []
    return Outcome(bench, tuple(errors.tolist()), held, tuple(named), beam, cpu, said)


def line(outcome: Outcome) -> str:
    """One bench, for people."""
    bench = outcome.bench
    there = f"{bench.beam}{'' if bench.told == bench.beam else f' told {bench.told}'} {bench.disturbance}".strip()
    errors = " ".join(f"{error:+.1f}" for error in outcome.errors) or "no fit"
    marks = ("right" if outcome.right else "WRONG", "FALSE" if outcome.false else "")
    named = f"{' '.join(outcome.named)} {outcome.beam}".strip()
    return (
        f"{bench.number:2d} {bench.rate:4.0f} Hz {'edge times' if bench.edge_times else 'counts':10s} {there:28s} "
        f"{' '.join(marks):11s} {errors:16s} {named:40s} {outcome.cpu:.1f} s {outcome.said}"
    )


def summary(outcomes: Sequence[Outcome]) -> str:
    """The shares."""
    wrong = [one for one in outcomes if one.bench.told != one.bench.beam]
    disturbed = [one for one in outcomes if one.bench.disturbance]
    fitted = [one for one in outcomes if one.errors]
    found = sum(any(one.bench.disturbance in named.split("/") for named in one.named) for one in disturbed)
    alone = sum(any(one.bench.disturbance == named for named in one.named) for one in disturbed)
    scatter = np.sqrt(np.mean(np.square([one.errors for one in fitted] or [[np.nan] * 3]), axis=0))
    return (
        f"first fit right {sum(one.right for one in outcomes)} of {len(outcomes)}, false alarms "
        f"{sum(one.false for one in outcomes)}, wrong beam named "
        f"{sum(one.seen for one in wrong)} of {len(wrong)} ({sum(one.beam == one.bench.beam for one in wrong)} alone), "
        f"disturbance named {found} of {len(disturbed)} ({alone} alone); 95 % intervals hold "
        f"{sum(one.held for one in fitted)} of {3 * len(fitted)}; error/sd "
        f"{' '.join(f'{one:.2f}' for one in scatter)}; CPU {np.median([one.cpu for one in outcomes]):.1f} s"
    )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--benches", type=int, default=60)
    parser.add_argument("--only", default="", help="numbers with commas, in place of these")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--keep", help="folder of logs that are not recorded again")
    asked = parser.parse_args()
    numbers = [int(one) for one in asked.only.split(",") if one]
    benches = [Blind(n) for n in numbers or range(asked.first, asked.first + asked.benches)]
    os.environ.setdefault("COLUMNS", "200")
    with tempfile.TemporaryDirectory() as work, ProcessPoolExecutor(asked.workers) as pool:
        folders = [Path(asked.keep or work) / f"bench{one.number}" for one in benches]
        outcomes = []
        for outcome in pool.map(judged, benches, folders):
            print(line(outcome), flush=True)
            outcomes.append(outcome)
    print(summary(outcomes))


if __name__ == "__main__":
    main()
