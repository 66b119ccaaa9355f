"""What `design` foretells, against fits that have the proposed logs beside, on benches emulated by foreign code.

Run:  python tests/benchmarks/bench_design.py [--cases 20] [--logs 2] [--first 100]
Each case is another bench (as in bench_disturbances, with constants as they are stated, so that errors are those of
noise): a fit of three logs of 10 s and a free decay, a plan of further logs, and fits with one of them and with all
beside, and with as many like the first ones. Printed for each case: foretold over stated deviation, geometric mean over
mu_s, mu_k, p, and the farthest of them; in all, how many are within 20 %, and root mean square of the real error over
the deviation that was foretold. Then the starts: whether proposed drives near the end of the cycle stick and slip when
begun as is said, and when the body is let go from its rest.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[1] / "helpers"), str(Path(__file__).parent)]

from bench_disturbances import FASTEST, SLOWEST  # noqa: E402
from foreign_bench import foreign_logs  # noqa: E402
from oracle.bench import Bench, Drive, slips_and_sticks  # noqa: E402

from fmu_models.base.errors import StickslipError  # noqa: E402
from identification.fit.fit import fit_friction  # noqa: E402
from identification.fit.result import FrictionFit  # noqa: E402
from identification.next_step.design import Candidate, Design, design  # noqa: E402
from rig_io.logs.log import RigLog  # noqa: E402

WITHIN, DURATION = 0.2, 10.0
AT_REST = 1e-3  # m/s of slip: a stick


def cases(first: int) -> Iterator[tuple[int, Bench, tuple[float, ...], np.ndarray, list[RigLog], FrictionFit]]:
    """Seed, bench, drive speeds, truth, logs and their fit, of benches that stick and slip at all three speeds."""
    for seed in range(first, first + 1000):
        rng = np.random.default_rng([seed, *b"design"])
        mu_k, fall, p = rng.uniform([0.25, 0.12, 9.0], [0.42, 0.3, 22.0])
        speeds = tuple(np.exp(rng.uniform(SLOWEST, FASTEST)))
        bench = Bench(lambda v, fall=fall, p=p, mu_k=mu_k: fall / (1 + p * v) + mu_k)
        logs = foreign_logs(bench, seed, speeds, DURATION)
        try:
            yield seed, bench, speeds, np.array([mu_k + fall, mu_k, p]), logs, fit_friction(logs)
        except StickslipError:
            continue


def ratios(foretold: Mapping[str, float], fit: FrictionFit) -> np.ndarray:
    """Foretold over stated deviations (3,)."""
    return np.array([sd / fit[name].standard_deviation for name, sd in foretold.items()])


def sticks(bench: Bench, w: float, let_go: float | None = None) -> bool:
    """Whether the body sticks in the second half of a log."""
    drive = Drive(bench, w, DURATION, np.random.default_rng(1))
    time, angle = slips_and_sticks(bench, drive, DURATION, 0, let_go)
    slip = bench.r * np.interp(time, drive.time, drive.speed) - bench.R * np.gradient(angle, time)
    return bool(np.any(np.abs(slip[len(slip) // 2 :]) < AT_REST))


def fastest(found: Design) -> list[Candidate]:
    """The two fastest drives that are proposed."""
    proposed = [one for one in found.candidates if one.refused is None]
    return sorted(proposed, key=lambda one: -one.drive_speed)[:2]


def within(rows: list[np.ndarray]) -> str:
    """How many are within 20 %: geometric means, all three parameters, single ones; their mean."""
    table = np.array(rows)
    mean = np.exp(np.log(table).mean(axis=1))
    close, all_close = np.abs(mean - 1) <= WITHIN, np.all(np.abs(table - 1) <= WITHIN, axis=1)
    single = np.mean(np.abs(table - 1) <= WITHIN, axis=0)
    return (
        f"geometric mean {close.sum()} of {len(table)}, all three {all_close.sum()}, each "
        f"{' '.join(f'{100 * share:.0f} %' for share in single)}, on average {np.exp(np.log(mean).mean()):.3f}"
    )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--logs", type=int, default=2)
    parser.add_argument("--first", type=int, default=100, help="seed")
    asked = parser.parse_args()
    rows: dict[str, list[np.ndarray]] = {"one log": [], "all logs": [], "repeated": []}
    errors: list[np.ndarray] = []
    starts = np.zeros(4, dtype=int)
    for (seed, bench, speeds, truth, logs, fit), _ in zip(cases(asked.first), range(asked.cases), strict=False):
        found = design(fit, duration=DURATION, logs=asked.logs)
        plan = found.plan
        again = [speeds[number % len(speeds)] for number in range(asked.logs)]
        made = foreign_logs(bench, seed, (*speeds, *(one.drive_speed for one in plan.logs), *again), DURATION)
        more, like = made[len(speeds) : -1 - asked.logs], made[-1 - asked.logs : -1]
        first, last = plan.logs[0].deviations, plan.logs[-1].deviations
        beside = {"one log": (more[:1], first), "all logs": (more, last), "repeated": (like, plan.repeated)}
        words = []
        for name, (others, foretold) in beside.items():
            after = fit_friction([*logs, *others])
            rows[name].append(ratios(foretold, after))
            mean, farthest = np.exp(np.log(rows[name][-1]).mean()), max(rows[name][-1], key=lambda q: abs(np.log(q)))
            words.append(f"{name} {mean:.2f} {farthest:.2f}")
            if name == "one log":
                errors.append((after.law_values - truth) / list(foretold.values()))
        gain = np.exp(np.mean(np.log(np.array([*last.values()]) / [*plan.repeated.values()])))
        drives = " ".join(f"{one.drive_speed:.3g}" for one in plan.logs)
        print(f"{seed}  {'  '.join(words)}  at {drives} rad/s, {gain:.2f} of the repetition's", flush=True)
        for one in fastest(found):
            said, rest = sticks(bench, one.drive_speed, one.start_angle), sticks(bench, one.drive_speed, 0.0)
            starts += [1, sticks(bench, one.drive_speed), said, rest]
    for name, table in rows.items():
        print(f"{name:9s} foretold over stated: {within(table)}")
    scatter = np.sqrt(np.mean(np.square(errors), axis=0))
    print(f"error over foretold deviation, rms: {' '.join(f'{one:.2f}' for one in scatter)} (mu_s, mu_k, p)")
    print("fastest proposals {}: stick with the drive brought up {}, let go as said {}, from rest {}".format(*starts))


if __name__ == "__main__":
    main()
