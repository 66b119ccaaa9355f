"""Calibration from guesses half off: how often the truth is found and held by 95 % intervals, and what it costs.

    python tests/benchmarks/bench_calibrate.py [--seeds 20] [--first-seed 0] [--only hinge,ball] [--peer] [--data DIR]

A seed draws noise, start states up to a tenth from the default and first values, each off by a factor 1.5 to either
side (an angle by .25 rad). *Fits* counts seeds whose residuals are the noise, by four deviations of their root mean
square; *inside* the parameters that their 95 % intervals hold, over the seeds that fit; *z* is the root mean square of
errors in deviations, *s* are CPU seconds. Measured logs (`calibrated_machines.py`) are searched from seeds too: *least*
and *worst* are the root mean squares at which these end. Their files are not part of the project; a case without its
file says so. With --peer the same seeds are given to lmfit, which minimizes over runs of fmpy (CVode) from the same
first values, as a user of these two would.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

sys.path += [str(Path(__file__).parent), str(Path(__file__).parents[1] / "foreign")]
from calibrated_machines import MACHINES, MeasuredCase
from models import foreign

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.load import load
from fmu_models.importer.simulate import simulate_any
from fmu_models.simulation.run import simulate
from identification.calibration.calibrate import calibrate

OFF = 1.5
NORMAL = 1.96  # deviations to either side that hold 95 %
CERTAIN = 4.0  # deviations of the root mean square of white noise
START_SPREAD = 0.1


@dataclass(frozen=True)
class EmulatedCase:
    """A log with a known truth. free: true values; noise: sd of the measured variable, s of event times; until: s;
    others: parameters that are known; foreign: the model is a C file of tests/foreign; events: a contact whose times
    are the log; scattered: whether start states are drawn; settings: of `calibrate`."""

    model: str
    measured: str
    until: float
    samples: int
    noise: float
    free: Mapping[str, float]
    others: Mapping[str, float] = field(default_factory=dict)
    foreign: bool = False
    events: bool = False
    scattered: bool = True
    correlation: float = 0.0
    settings: Mapping[str, Any] = field(default_factory=dict)


SUPPORT = {"ks": 10.0, "cs": 0.3, "g": 4.0, "k": 1.0, "c": 0.05, "f0": 0.5}
CHAOTIC = {"ks": 1000.0, "cs": 0.6, "g": 2.0, "k": 1.0, "c": 0.05, "f0": 0.62}
BELT = {"a0": 1.5, "a1": 1.5, "a3": 0.45, "k": 1.0, "f0": 0.1}
PAIR = {"D": 6.0, "A": 1.0, "e": 0.6, "phi0": 0.0}
HINGE = {"zeta": 0.2, "delta": 0.01, "k0": 300.0, "ce": 0.9, "f": 0.429, "tau": 0.0}
BALL = {"e": 0.7, "A": 6e-3, "phi0": 0.0}
PECKER = {"eN1": 0.5, "mu2": 0.3}
CASES: dict[str, EmulatedCase] = {
    "support": EmulatedCase("discontinuous_support", "x", 60.0, 601, 0.01, SUPPORT),
    "support-ar": EmulatedCase("discontinuous_support", "x", 60.0, 601, 0.01, SUPPORT, correlation=0.95),
    "belt": EmulatedCase("forced_stick_slip", "x", 60.0, 601, 0.005, BELT),
    "pair": EmulatedCase("impact_pair", "x", 40.0, 801, 0.01, PAIR),
    "hinge": EmulatedCase("hinge_clearance", "x", 60.0, 1201, 0.002, HINGE),
    "ball": EmulatedCase("bouncing_ball", "x", 3.0, 3001, 5e-5, BALL),
    "chaotic": EmulatedCase("discontinuous_support", "x", 80.0, 801, 0.01, CHAOTIC, {"omega": 0.9}),
    "woodpecker": EmulatedCase("woodpecker", "phi_S", 0.6, 601, 0.002, PECKER, scattered=False),
    "impacts": EmulatedCase("bouncing_ball", "table", 3.0, 0, 1e-5, BALL, events=True),
    "VanDerPol": EmulatedCase("van_der_pol", "x", 20.0, 201, 0.02, {"mu": 1.0}, foreign=True),
    "BouncingBall-h": EmulatedCase("ball", "h", 2.2, 441, 0.01, {"e": 0.7, "g": 9.81}, foreign=True),
    "BouncingBall-v": EmulatedCase("ball", "v", 2.2, 441, 0.05, {"e": 0.7, "g": 9.81}, foreign=True),
}


def colored(case: EmulatedCase, count: int, random: np.random.Generator) -> np.ndarray:
    """(count,) noise, whose neighbours correlate as the case says."""
    noise = random.normal(size=count)
    for row in range(1, count):
        noise[row] = case.correlation * noise[row - 1] + np.sqrt(1 - case.correlation**2) * noise[row]
    return case.noise * noise


def emulated(case: EmulatedCase, fmu: Fmu, random: np.random.Generator) -> dict[str, np.ndarray]:
    """The log of a seed."""
    parameters = {**case.others, **case.free}
    start = {}
    if case.scattered:
        scatter = {name: 1 + START_SPREAD * random.uniform(-1, 1) for name in fmu.states}
        start = {name: float(fmu.variables[name].start or 0) * factor for name, factor in scatter.items()}
    if case.events:
        run = simulate(fmu, case.until, parameters=parameters, start=start)
        times = np.array([event.time for event in run.impacts])
        return {"hit": times + colored(case, times.size, random)}
    times = np.linspace(0.0, case.until, case.samples)
    if case.foreign:
        run = simulate_any(
            fmu, case.until, parameters=parameters, start=start, output_times=times, tolerance=1e-10, on_zeno="hold"
        )
    else:
        run = simulate(fmu, case.until, parameters=parameters, start=start, output_times=times)
    return {"time": times, case.measured: run[case.measured] + colored(case, times.size, random)}


def first_values(truth: Mapping[str, float], fmu: Fmu, random: np.random.Generator) -> dict[str, float]:
    """Half off, inside of the bounds that the model declares."""
    values = {}
    for name, value in truth.items():
        side = random.choice([-1, 1])
        if fmu.variables[name].unit == "rad":
            values[name] = value + 0.25 * side
        else:
            most = fmu.variables[name].max
            values[name] = min(value * OFF**side, 0.95 * float(most) if most is not None else np.inf)
    return values


@dataclass(frozen=True)
class Seed:
    """What came of one seed: rms relative to the noise, number of samples, z (parameters,), inside (parameters,),
    cpu s."""

    misfit: float
    samples: int
    z: np.ndarray
    inside: np.ndarray
    cpu: float
    values: Mapping[str, float]

    def fits(self, correlation: float) -> bool:
        """Whether the residuals are the noise, whose neighbours correlate."""
        independent = self.samples * (1 - correlation**2) / (1 + correlation**2)
        return self.misfit < 1 + CERTAIN / np.sqrt(2 * independent)


Solved = tuple[dict[str, tuple[float, float]], float, int]  # value and deviation by name, rms, samples


def suite(case: EmulatedCase, fmu: Fmu, log: dict[str, np.ndarray], known: dict[str, float], seed: int) -> Solved:
    """By `calibrate`."""
    events = {"events": {case.measured: "hit"}} if case.events else {}
    fit = calibrate(fmu, log, free=list(case.free), parameters=known, seed=seed, **events, **case.settings)
    (line,) = fit.residuals
    return (
        {name: (fit[name].value, fit[name].standard_deviation or np.inf) for name in case.free},
        line.rms,
        line.samples,
    )


def peer(case: EmulatedCase, fmu: Fmu, log: dict[str, np.ndarray], known: dict[str, float], seed: int) -> Solved:
    """By lmfit over fmpy: parameters and start states from the same first values; a run that fails is far off."""
    import fmpy
    import lmfit

    names = [*case.free, *(fmu.states if case.scattered else [])]
    keys = {f"p{number}": name for number, name in enumerate(names)}
    sought = lmfit.Parameters()
    for key, name in keys.items():
        bound = fmu.variables[name].max
        most = np.inf if bound is None else float(bound)
        sought.add(key, value=known.get(name, fmu.start_of(name)), min=0.0 if name in case.free else -np.inf, max=most)
    fixed = {name: value for name, value in known.items() if name not in names}
    instance: Any = fmpy.instantiate_fmu(str(fmu.folder), fmu.description, fmi_type="ModelExchange")

    def residual(values: lmfit.Parameters) -> np.ndarray:
        start = {**fixed, **{name: values[key].value for key, name in keys.items()}}
        instance.reset()
        try:
            run = fmpy.simulate_fmu(
                str(fmu.folder), model_description=fmu.description, fmu_instance=instance, fmi_type="ModelExchange",
                stop_time=case.until, output_interval=case.until / (case.samples - 1), relative_tolerance=1e-8,
                start_values=start, output=[case.measured], record_events=False,
            )  # fmt: skip
            seen = np.interp(log["time"], run["time"], run[case.measured])
        except Exception:
            seen = np.zeros(case.samples)
        return (seen - log[case.measured]) / case.noise

    fit: Any = lmfit.minimize(residual, sought)
    values = {name: (fit.params[key].value, fit.params[key].stderr or np.inf) for key, name in keys.items()}
    return values, case.noise * float(np.sqrt(np.mean(fit.residual**2))), case.samples


def run_seed(case: EmulatedCase, fmu: Fmu, seed: int, solve: Callable[..., Solved] = suite) -> Seed | str:
    """One seed, or why it was refused."""
    random = np.random.default_rng([seed, 31])
    log = emulated(case, fmu, random)
    known = {**case.others, **first_values(case.free, fmu, random)}
    began = time.process_time()
    try:
        values, rms, samples = solve(case, fmu, log, known, seed)
    except StickslipError as error:
        return str(error)
    cpu = time.process_time() - began
    z = np.array([(values[name][0] - truth) / values[name][1] for name, truth in case.free.items()])
    found = {name: value for name, (value, _) in values.items()}
    return Seed(rms / case.noise, samples, z, np.abs(z) <= NORMAL, cpu, found)


def emulated_row(
    name: str, case: EmulatedCase, fmu: Fmu, seeds: range, verbose: bool, solve: Callable[..., Solved] = suite
) -> str:
    """A line of the table."""
    results = []
    for seed in seeds:
        results.append(run_seed(case, fmu, seed, solve))
        if verbose:
            print(f"  {name} {seed}: {results[-1]}", flush=True)
    solved = [one for one in results if isinstance(one, Seed)]
    fits = [one for one in solved if one.fits(case.correlation)]
    if not fits:
        return f"{name:15} {0:3} of {len(seeds)}"
    inside = np.concatenate([one.inside for one in fits])
    z = np.concatenate([one.z for one in fits])
    cpu = [one.cpu for one in solved]
    return (
        f"{name:15} {len(fits):3} of {len(seeds)}   {np.mean(inside):6.2f} of {inside.size:<4} "
        f"{np.sqrt(np.mean(z**2)):5.2f}   {np.median(cpu):6.2f} {np.max(cpu):6.2f}"
    )


def measured_row(name: str, case: MeasuredCase, data: Path, seeds: range, verbose: bool) -> str:
    """A line of the table of measured logs."""
    log, inputs = case.log(data)
    fmu, misfits, cpu = load(case.model), [], []
    for seed in seeds:
        random = np.random.default_rng([seed, 31])
        first = case.first_values(OFF, random)
        began = time.process_time()
        fit = calibrate(fmu, log, free=list(case.free), parameters=first, inputs=inputs, seed=seed, **case.settings)
        cpu.append(time.process_time() - began)
        misfits.append(fit.residuals[0].rms)
        if verbose:
            print(f"  {name} {seed}: {misfits[-1]:.3g} {cpu[-1]:.1f} s {fit.method} {fit.values}", flush=True)
    near = sum(misfit < 1.1 * case.reached for misfit in misfits)
    return (
        f"{name:15} {near:3} of {len(seeds)}   {min(misfits):9.3g} {max(misfits):9.3g} ({case.reached:g})   "
        f"{np.median(cpu):6.2f} {np.max(cpu):6.2f}"
    )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--only", default=",".join((*CASES, *MACHINES)), help="with commas (default: all)")
    parser.add_argument("--data", type=Path, default=Path(__file__).parents[2].parent / "shared" / "data")
    parser.add_argument("--peer", action="store_true", help="lmfit over fmpy beside, on emulated logs")
    parser.add_argument("--verbose", action="store_true", help="a line for each seed")
    asked = parser.parse_args()
    names = asked.only.split(",")
    if unknown := [name for name in names if name not in CASES and name not in MACHINES]:
        parser.error(f"There is no case '{unknown[0]}'; there are {', '.join((*CASES, *MACHINES))}.")
    seeds = range(asked.first_seed, asked.first_seed + asked.seeds)
    with warnings.catch_warnings(action="ignore"), tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        print(f"{'emulated':15} {'fits':>10}   {'inside':14} {'z':>5}   {'s':>6} {'worst':>6}")
        for name in (name for name in names if name in CASES):
            case = CASES[name]
            fmu = Fmu.open(foreign(case.model, Path(folder), 2)) if case.foreign else load(case.model)
            print(emulated_row(name, case, fmu, seeds, asked.verbose), flush=True)
            if asked.peer and not case.events:
                print(emulated_row("  lmfit, fmpy", case, fmu, seeds, asked.verbose, peer), flush=True)
        print(f"{'measured':15} {'reached':>10}   {'least':>9} {'worst':>9} {'(known)':9} {'s':>6} {'worst':>6}")
        for name in (name for name in names if name in MACHINES):
            if reason := MACHINES[name].missing(asked.data):
                print(f"{name:15} skipped: {reason}")
            else:
                print(measured_row(name, MACHINES[name], asked.data, seeds, asked.verbose), flush=True)


if __name__ == "__main__":
    main()
