"""Fits on benches with disturbances, emulated by code that is not ours: what is named, and whether the law holds.

Run:  python tests/benchmarks/bench_disturbances.py [--seeds 10] [--cases clean,wear] [--estimator shooting]
Each seed is another bench: a Conti law of its own, three drive speeds, 10 s each, and a free decay; constants drawn
from what is stated of them. Cases that begin with "u:" are known to no estimator: a name for them is wrong. A name is
right too where the fit says that the logs do not tell it from the right one. Printed for each case: benches fitted,
those with exactly the right names, those with a wrong one, those on which something was left unexplained; share of 95 %
intervals of mu_s, mu_k, p that hold the truth, root mean square of error over deviation; deviation over the bound of
Cramer and Rao with what constants add, median and 90 % point; free curves, the share of their points within 1.96
deviations of the truth, and how many have it within the band of the whole curve; CPU time of a fit, median.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[1] / "helpers")]

from foreign_bench import Faults, foreign_logs, with_drawn_constants  # noqa: E402
from oracle.bench import Bench  # noqa: E402

from fmu_models.base.errors import StickslipError  # noqa: E402
from identification.fit.fit import fit_friction  # noqa: E402
from identification.fit.result import FrictionFit  # noqa: E402

SLOWEST, FASTEST = np.log([0.35, 0.6, 0.9]), np.log([0.5, 0.8, 1.1])  # rad/s, of the drives


@dataclass(frozen=True)
class Case:
    """What is done to a bench; names: that are right; perhaps: that need not be told; bent: fields of the bench."""

    names: frozenset[str] = frozenset()
    perhaps: frozenset[str] = frozenset()
    bent: dict[str, Any] = field(default_factory=dict)
    faults: Faults = field(default_factory=Faults)
    both_ways: bool = False


def conti(mu_s: float, mu_k: float, p: float, speed: Any) -> Any:
    """Friction coefficient at slip speeds, m/s."""
    return mu_k + (mu_s - mu_k) / (1 + p * speed)


def either(rng: np.random.Generator, low: float, high: float) -> float:
    """A size of either sign."""
    return float(rng.uniform(low, high) * rng.choice([-1, 1]))


def factor(names: str, of: Callable[[float, float, int, float], float]) -> Case:
    """A factor of friction: (time, angle of the body, log, angle of the drive)."""
    return Case(frozenset(names.split()), bent={"factor": of})


def bare(without: str, **bent: Any) -> Case:
    """Fewer instruments."""
    return Case(bent=bent, faults=Faults(without=without))


def uneven(rng: np.random.Generator, without: str = "drive") -> Case:
    return replace(bare(without), names=frozenset({"drive-uneven"}))


def spring(rng: np.random.Generator, low: float = 0.05, high: float = 0.5) -> Case:
    return Case(frozenset({"spring"}), bent={"k3": either(rng, low, high)})


def damping(rng: np.random.Generator) -> Case:
    return Case(frozenset({"damping"}), bent={"c2": float(rng.uniform(0.002, 0.01))})


def wear(rng: np.random.Generator, low: float = 0.003, high: float = 0.02) -> Case:
    """Friction of the first log in its middle is that of the law."""
    size = either(rng, low, high)
    return factor("wear", lambda t, angle, log, turned: 1 + size * (log + t / 10 - 0.5))


def load(rng: np.random.Generator) -> Case:
    """The normal force of each log is another, by .3 %; the first is that of the law."""
    change = 0.003 * rng.permutation([-1, 1])
    return factor("wear", lambda t, angle, log, turned: 1 + [0.0, *change][log])


def warm_up(rng: np.random.Generator) -> Case:
    """The mean over a log is the law."""
    size, lasts = either(rng, 0.02, 0.05), float(rng.choice([5.0, 10.0, 20.0]))
    mean = lasts / 10 * (1 - np.exp(-10 / lasts))
    return factor("warm-up", lambda t, angle, log, turned: 1 + size * (np.exp(-max(t, 0.0) / lasts) - mean))


def normal_force(rng: np.random.Generator) -> Case:
    size, phase = rng.uniform(0.003, 0.02), rng.uniform(0, 6.28)
    return factor("normal-force", lambda t, angle, log, turned: 1 + size * np.cos(turned + phase))


def drive_encoder(rng: np.random.Generator) -> Case:
    size, phase = rng.uniform(0.003, 0.01), rng.uniform(0, 6.28)
    return Case(frozenset({"drive-encoder"}), faults=Faults(drive=lambda turned: size * np.sin(turned + phase)))


def laser_bend(rng: np.random.Generator) -> Case:
    size = either(rng, 0.02, 0.06)
    return Case(frozenset({"laser-bend"}), faults=Faults(laser=lambda t, angle: size * angle**2))


def spring_and_wear(rng: np.random.Generator) -> Case:
    both, worn = spring(rng), wear(rng)
    return Case(both.names | worn.names, bent={**both.bent, **worn.bent})


def direction(rng: np.random.Generator) -> Case:
    return Case(frozenset({"direction"}), bent={"sided": either(rng, 0.005, 0.03)}, both_ways=True)


def body_encoder(rng: np.random.Generator) -> Case:
    """It is eccentric, which within a fifth of a radian is one more gain: no name, but values that hold."""
    size, phase = rng.uniform(3e-3, 1e-2), rng.uniform(0, 6.28)
    return Case(faults=Faults(body=lambda angle: size * np.sin(angle + phase)))


def laser_clock(rng: np.random.Generator) -> Case:
    """Drives that turn almost evenly are no clock: no name, but values that hold."""
    late, rate = either(rng, 5e-4, 2e-3), either(rng, 1e-4, 3e-4)
    return Case(faults=Faults(late=lambda t: late + rate * (t - 5), without="encoder"))


def vibration(rng: np.random.Generator) -> Case:
    size, rate = rng.uniform(1e-4, 4e-4), rng.uniform(12, 90)
    return Case(
        frozenset({"laser-vibration"}), faults=Faults(laser=lambda t, angle: size * np.sin(2 * np.pi * rate * t))
    )


def walk(rng: np.random.Generator, alone: bool = False) -> Case:
    """0.1 to 0.2 mm after ten seconds."""
    steps = np.cumsum(rng.standard_normal(20_000)) * rng.uniform(1e-4, 2e-4) / 0.125 / 100
    names = frozenset({"laser-walk"} if alone else ())
    return Case(names, faults=Faults(laser=lambda t, angle: steps[: len(t)], without="encoder" if alone else ""))


def torque(of: Callable[[float, float], float], names: str = "", perhaps: str = "") -> Case:
    """A torque beside, N m: (time, angle of the body)."""
    return Case(frozenset(names.split()), frozenset(perhaps.split()), {"torque": of})


def magnet(rng: np.random.Generator) -> Case:
    """Narrow, on one side of the body; a free decay passes it too."""
    size, at, width = either(rng, 2e-3, 6e-3), rng.uniform(0.0, 0.12), rng.uniform(0.005, 0.02)
    return torque(
        lambda t, angle: size * (angle - at) / width * np.exp(0.5 - 0.5 * ((angle - at) / width) ** 2), perhaps="pull"
    )


def coloured(rng: np.random.Generator, size: float, slowest: float, fastest: float) -> Callable[[float, float], float]:
    """Noise between two rates, Hz."""
    rates = 2 * np.pi * np.exp(rng.uniform(np.log(slowest), np.log(fastest), 12))
    phases = rng.uniform(0, 6.28, 12)
    return lambda t, angle: size / 2.45 * float(np.sum(np.sin(rates * t + phases)))


def bearing(rng: np.random.Generator) -> Case:
    return torque(coloured(rng, float(rng.uniform(5e-4, 2e-3)), 1.0, 15.0))


def draft(rng: np.random.Generator) -> Case:
    return torque(coloured(rng, float(rng.uniform(5e-4, 2e-3)), 0.05, 0.8))


def cable(rng: np.random.Generator) -> Case:
    """It is straight beyond an angle, and pulls."""
    size, at = rng.uniform(0.01, 0.04), rng.uniform(0.05, 0.12)
    return torque(lambda t, angle: -size * max(angle - at, 0.0), "pull")


def table(rng: np.random.Generator) -> Case:
    size, rate = rng.uniform(5e-4, 3e-3), rng.uniform(2, 8)
    return torque(lambda t, angle: size * np.sin(2 * np.pi * rate * t))


def warm_laser(rng: np.random.Generator, alone: bool = False) -> Case:
    """Its gain follows its temperature; an encoder beside takes that off."""
    size, names = either(rng, 1e-3, 4e-3), frozenset({"laser-gain"} if alone else ())
    faults = Faults(laser=lambda t, angle: size * np.sin(angle) * np.exp(-t / 4), without="encoder" if alone else "")
    return Case(names, faults=faults)


def rocking(rng: np.random.Generator) -> Case:
    size = float(rng.uniform(0.003, 0.01))
    return factor("", lambda t, angle, log, turned: 1 + size * np.sin(2 * np.pi * 3.3 * t))


CASES: dict[str, Callable[[np.random.Generator], Case]] = {
    "clean": lambda rng: Case(),
    **{"spring": spring, "damping": damping, "wear": wear, "warm-up": warm_up, "normal-force": normal_force},
    **{"drive-encoder": drive_encoder, "laser-bend": laser_bend, "spring+wear": spring_and_wear},
    **{"direction": direction, "wear-.3%": lambda rng: wear(rng, 0.003, 0.003), "load-.3%": load},
    **{"spring-.2%": lambda rng: spring(rng, 0.05, 0.05)},
    **{"laser-vibration": vibration, "laser-walk": lambda rng: walk(rng, alone=True)},
    **{"clean-both": lambda rng: Case(both_ways=True), "clean-alone": lambda rng: bare("encoder")},
    **{"nominal-even": lambda rng: bare("drive", ripple=(0.0, 0.0), hunting=0.0), "nominal": uneven},
    **{"by-encoder": lambda rng: bare("laser"), "by-encoder-nominal": lambda rng: uneven(rng, "laser drive")},
    **{"walk": walk, "u:rocking": rocking, "u:magnet": magnet, "u:bearing": bearing, "u:draft": draft},
    **{
        "cable": cable,
        "u:table": table,
        "warm-laser": warm_laser,
        "laser-gain": lambda rng: warm_laser(rng, alone=True),
        "u:body-encoder": body_encoder,
        "u:laser-clock": laser_clock,
    },
}


def fitted(name: str, seed: int, estimator: str) -> tuple[FrictionFit, np.ndarray, Case, float]:
    """The fit of one bench, the truth, what was done, and the CPU time.

    Raises:
        StickslipError: the logs hold no stick-slip, or cannot be fitted.
    """
    rng = np.random.default_rng([seed, *name.encode()])
    mu_k, fall, p = rng.uniform([0.25, 0.12, 9.0], [0.42, 0.3, 22.0])
    case, speeds = CASES[name](rng), np.exp(rng.uniform(SLOWEST, FASTEST))
    bench = with_drawn_constants(replace(Bench(partial(conti, mu_k + fall, mu_k, p)), **case.bent), rng)
    if case.both_ways:
        speeds = speeds * [1, -1, 1]
    logs = foreign_logs(bench, int(rng.integers(2**31)), tuple(speeds), faults=case.faults)
    begin = time.process_time()
    fit = fit_friction(logs, estimator=estimator)
    return fit, np.array([mu_k + fall, mu_k, p]), case, time.process_time() - begin


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--estimator", default="shooting")
    parser.add_argument("--cases", default=",".join(CASES), help="with commas; default: all")
    asked = parser.parse_args()
    for name in asked.cases.split(","):
        exact, wrong, unexplained, errors, widths, times, curves, whole = 0, 0, 0, [], [], [], [], []
        for seed in range(asked.seeds):
            try:
                fit, truth, case, took = fitted(name, seed, asked.estimator)
            except StickslipError as error:
                print(f"  {name} {seed}: {error}"[:150], flush=True)
                continue
            told = [{cause.name, *cause.alike} for cause in fit.causes]
            right = all(any(name in one for one in told) for name in case.names)
            false = any(one.isdisjoint(case.names | case.perhaps) for one in told)
            exact, wrong = exact + (right and not false), wrong + false
            unexplained += fit.free is not None and fit.free.unexplained > 0
            errors.append((fit.law_values - truth) / [parameter.total_deviation for parameter in fit.parameters])
            widths += [q.total_deviation / np.hypot(q.bound or np.nan, q.scale_deviation) for q in fit.parameters]
            times.append(took)
            if fit.free is not None:
                law = partial(conti, *truth)
                seen, off = fit.free.speed >= fit.free.least, fit.free.coefficient - law(fit.free.speed)
                curves.append(np.mean(np.abs(off[seen]) < 1.96 * fit.free.deviation[seen]))
                whole.append(not fit.free.departures(law))
        if errors:
            held, scatter = np.mean(np.abs(errors) < 1.96), np.sqrt(np.mean(np.square(errors), axis=0))
            print(
                f"{name:14s} fitted {len(errors):2d}  exact {exact:2d}  wrong {wrong:2d}  unexplained {unexplained:d}  "
                f"held {100 * held:3.0f} %  error/sd {' '.join(f'{one:.2f}' for one in scatter)}  "
                f"width {np.median(widths):.2f} {np.quantile(widths, 0.9):.2f}  "
                f"curves {len(curves)} {100 * np.mean(curves or np.nan):.0f} % {sum(whole)}  "
                f"CPU {np.median(times):.1f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
