"""Whether fits of emulated loops and decays hold the truth, and what they say of benches with faults they do not know.

Run:  python tests/benchmarks/bench_loops.py coverage|coarse|faults|decays [--seeds 100] [--only Dahl,lag]
coverage: how many 95 % intervals of each law hold the truth, with noise of .1 % of way and force; a row for each law.
coarse: the same with 20 samples a cycle, and how many of the logs are said to have too few.
faults: loops of benches with one fault each; what comes out over the truth, how much is left, and which words are new
beside those of a bench without it.
decays: both of decays.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1] / "helpers")]

from loop_benches import LAWS, NOISY, holding, loop_log  # noqa: E402

from identification.hysteresis.decay import fit_decays  # noqa: E402
from identification.hysteresis.identify import identify_hysteresis  # noqa: E402
from rig_io.bench.joint import JointBench, record_loop  # noqa: E402
from rig_io.bench.settings import write_recorded  # noqa: E402
from rig_io.bench.swing import SwingBench, record_decay  # noqa: E402

# of a joint with a stiffness of 4e5 N/m that slides under 350 N, over 5 mm; a fault each
FAULTS: Mapping[str, Mapping[str, Any]] = {
    "none": {},
    "frame 2e6 N/m": {"frame": 2e6},
    "frame 8e5 N/m": {"frame": 8e5},
    "backlash .1 mm": {"backlash": 1e-4},
    "backlash .5 mm": {"backlash": 5e-4},
    "lag 2 ms": {"lag": 2e-3},
    "lag 10 ms": {"lag": 1e-2},
    "lag -10 ms": {"lag": -1e-2},
    "drift 3 %": {"drift": 10.0},
    "drift 10 %": {"drift": 35.0},
    "wear 5 %": {"wear": 0.05},
    "wear 20 %": {"wear": 0.2},
    "warm 30 K, -.5 %/K, read": {"warming": 30.0, "softening": -5e-3},
    "one-sided 10 %": {"one_sided": 0.1},
    "cubic 20 %": {"cubic": 70 / 5e-3**3},
    "rod 100 kg, no clock": {"inertia": 100.0},
    "saturated 60 N, no clock": {"saturated": 60.0},
    "N steps 20 %, not read": {"load_steps": 0.2},
    "offset 100 N": {"offset": 100.0},
    "cut .6 s": {"cut": 0.6},
    "steps 50 um": {"step_way": 5e-5},
    "steps 10 N": {"step_force": 10.0},
    "sign": {"sign": -1.0},
    "peaks": {"rows": "peaks"},
}
# 200 samples in a swing of 5/s
SWINGS: Mapping[str, Mapping[str, Any]] = {
    "none": {},
    "gravity read as a spring": {"kind": "gravity"},
    "driven 6 s": {"driven": 6.0},
    "3 runs": {"runs": 3.0},
    "2 runs driven": {"runs": 2.0, "driven": 7.0},
    "steps 10 mrad": {"step": 1e-2},
    "times jitter 50 %, 20 % lost": {"jitter": 0.5, "lost": 0.2},
    "zero 50 mrad": {"zero": 0.05},
    "cubic 10 %": {"cubic": 2.5},
    "breakaway 30 %": {"breakaway": 0.3},
    "uneven 30 %": {"uneven": 0.3},
    "draft .02": {"draft": 0.02},
    "draft .1": {"draft": 0.1},
    "eccentric 10 mrad": {"eccentric": 0.01},
    "eccentric 50 mrad": {"eccentric": 0.05},
    "drift 20 mrad": {"drift": 0.02},
}


def coverage(asked: argparse.Namespace, **more: Any) -> None:
    for name, (law, truth) in LAWS.items():
        if asked.only and name not in asked.only:
            continue
        begun, rows, refused, coarse = time.process_time(), [], 0, 0
        bench = JointBench(law=law, **(NOISY | more))
        for seed in range(asked.seeds):
            log = loop_log(record_loop(bench, seed=seed))
            try:
                fit = identify_hysteresis(log, laws=[name])
                rows.append(holding(fit, name, truth))
            except AssertionError:
                refused += 1
                continue
            coarse += any("samples a cycle" in note for note in fit.notes)
        z, held = (np.array(part) for part in zip(*rows, strict=True))
        shares = ", ".join(
            f"{one} {100 * share:.0f} % (bias {bias:+.2f} sd, rms z {rms:.2f})"
            for one, share, bias, rms in zip(
                truth, held.mean(axis=0), z.mean(axis=0), np.sqrt((z**2).mean(axis=0)), strict=True
            )
        )
        cpu = (time.process_time() - begun) / asked.seeds
        print(
            f"{name}: all {100 * held.mean():.1f} %; {shares}; refused {refused}, coarse said {coarse} of "
            f"{asked.seeds}, {cpu:.2f} s each",
            flush=True,
        )


def words(notes: Sequence[str], usual: Sequence[str]) -> list[str]:
    """Notes that are not said of a bench without a fault either, by their begins without numbers."""

    def bare(note: str) -> str:
        return "".join(c for c in note if not c.isdigit() and c not in ".e-+")[:60]

    known = {bare(note) for note in usual}
    return [note for note in notes if bare(note) not in known]


def faults(asked: argparse.Namespace) -> None:
    usual: list[str] | None = None
    truth = (4e5, 350.0)
    for name, fault in FAULTS.items():
        if asked.only and name != "none" and not any(one in name for one in asked.only):
            continue
        bench = replace(JointBench(), **(NOISY | {"noise_way": 2e-4} | dict(fault)))
        log = loop_log(record_loop(bench, seed=asked.seed), clock=asked.clock)
        fit = identify_hysteresis(log, laws=["MaxwellSlip-2"])
        notes = [*fit.notes, *(f"law: {note}" for law in fit.laws for note in (*law.notes, law.why) if note)]
        usual = notes if usual is None else usual
        spectrum = 100 * (fit.stiffness / truth[0] - 1), 100 * (fit.sliding_force / truth[1] - 1)
        off, said = "-", ""
        if fit.laws and not fit.laws[0].why:
            values = fit.laws[0].values
            stiffness = values["k_1"] + values["k_2"]
            slides = values["k_1"] * values["D_1"] + values["k_2"] * values["D_2"]
            off = f"{100 * (stiffness / truth[0] - 1):+.1f}, {100 * (slides / truth[1] - 1):+.1f}"
            off += f" (left {100 * fit.laws[0].worst:.2f} %)"
        said = " | ".join(words(notes, usual)) or "SILENT"
        left = 100 * max(fit.left.values())
        print(
            f"{name}: sliders k {spectrum[0]:+.1f} %, F {spectrum[1]:+.1f} %, left {left:.2f} %; law {off}; {said}",
            flush=True,
        )


def decays(asked: argparse.Namespace) -> None:
    truth = {"w0": 5.0, "f": 0.12, "c": 0.06, "b": 0.04}

    def fitted(bench: SwingBench, seed: int) -> Any:
        with tempfile.TemporaryDirectory() as folder:
            made = write_recorded(Path(folder) / "d", [record_decay(bench, seed=seed)], title="")
            return fit_decays(made / "decay.csv")

    usual: list[str] | None = None
    for name, fault in SWINGS.items():
        if asked.only and name != "none" and not any(one in name for one in asked.only):
            continue
        rows, begun, notes, left = [], time.process_time(), [], 0.0
        count = asked.seeds if name == "none" else min(asked.seeds, 3)
        for seed in range(count):
            fit = fitted(replace(SwingBench(noise=1e-3, zero=0.01), **fault), seed)
            ends = np.array([fit.interval(one) for one in truth])
            values, true = np.array([fit[one].value for one in truth]), np.array(list(truth.values()))
            rows.append((values - true, (ends[:, 0] <= true) & (true <= ends[:, 1])))
            left = max(line.rms for line in fit.residuals)
            notes += [*fit.warnings, *fit.directions]
        usual = notes if usual is None else usual
        error, held = (np.array(part) for part in zip(*rows, strict=True))
        off = ", ".join(
            f"{one} {100 * e / true:+.1f} % ({100 * h:.0f} % hold)"
            for (one, true), e, h in zip(truth.items(), error.mean(axis=0), held.mean(axis=0), strict=True)
        )
        said = " | ".join(dict.fromkeys(words(notes, usual))) or "SILENT"
        cpu = (time.process_time() - begun) / count
        print(f"{name}: {off}; left {1e3 * left:.2f} mrad; {said}; {cpu:.1f} s each", flush=True)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("coverage", "coarse", "faults", "decays"))
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0, help="of the faults")
    parser.add_argument("--only", type=lambda text: text.split(","), default=None, help="names, or parts of them")
    parser.add_argument("--clock", action="store_true", help="faults of logs that have times")
    asked = parser.parse_args()
    if asked.what == "coarse":
        coverage(asked, sampling_rate=20.0)
    else:
        {"coverage": coverage, "faults": faults, "decays": decays}[asked.what](asked)


if __name__ == "__main__":
    main()
