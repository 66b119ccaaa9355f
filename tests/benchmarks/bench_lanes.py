"""Strobes by the exact flow in lanes against those by the series of the engine: the same motions, in turn, CPU time.

    python tests/benchmarks/bench_lanes.py [repetitions]

Per model 256 motions over a range of a parameter, 300 periods; ns per motion and period, and how many times the series
take, for every number of lanes that this processor has; what the derivative of each step and all exponents take,
in parts of that; share of the steps that lanes left to the series; median and largest difference after 10 periods, in
parts of the largest point. Then what few motions gain that are made in one call: two, as the sweeps of a diagram up and
down would be, gain little, for their events come at other times; and what chains gain, sweeps of one parameter from as
many starts, whose events come at like times. Last, how much a
single run of 1000 periods could gain at most by the exact flow, with so many samples a period: all that it takes beside
its steps stays.
"""

from __future__ import annotations

import dataclasses
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from fmu_models.families.jobs import Jobs
from fmu_models.fmu.load import load
from fmu_models.lanes.library import lanes_of
from fmu_models.sections.strobe import Strobe

MOTIONS, PERIODS = 256, 300
FAMILIES = {
    "discontinuous_support": ("omega", {"ks": 300.0, "cs": 0.6, "g": 1.6}, "omega", (0.8, 1.0)),
    "bouncing_ball": ("omega", {}, "A", (2.7e-3, 3.7e-3)),
    "impact_pair": ("omega", {}, "D", (4.0, 9.0)),
    "impact_damper": ("omega", {}, "f0", (0.05, 0.2)),
    "fermi_accelerator": ("omega", {}, "L", (50.0, 110.0)),
    "two_domain_oscillator": ("W", {}, "w2", (1.2, 1.9)),
}
GO = np.zeros(1, np.int32)


def seconds(run: Callable[[], object], repetitions: int) -> float:
    """The least CPU time."""
    least = float("inf")
    for _ in range(repetitions):
        begin = time.process_time()
        run()
        least = min(least, time.process_time() - begin)
    return least


def families() -> Iterator[tuple[Strobe, Jobs]]:
    """The motions of each model."""
    for name, (forcing, values, varied, (low, high)) in FAMILIES.items():
        system = Strobe(load(name), forcing=forcing, parameters=values)
        starts = np.tile(system.start({"x": 0.0, "v": 0.0} if name.endswith("support") else {}), (MOTIONS, 1))
        yield system, Jobs(starts, {varied: np.linspace(low, high, MOTIONS)}, transient=PERIODS - 1, rows=1)
    # of one set of parameters, and of as many as there are motions
    for low, high in ((0.5, 0.5), (0.3, 0.6)):
        toy = Strobe(load("woodpecker"), period=0.146, autonomous=True)
        varied = {"eN1": np.linspace(low, high, MOTIONS)}
        yield toy, Jobs(np.tile(toy.start({}), (MOTIONS, 1)), varied, transient=PERIODS - 1, rows=1)


def few_motions(repetitions: int) -> None:
    """Gain of one call for some motions over a call for each, by number of lanes."""
    for name, (forcing, values, varied, (low, high)) in FAMILIES.items():
        system, cells = Strobe(load(name), forcing=forcing, parameters=values), []
        steppers = [one for width in (1, 2, 4, 8) if (one := lanes_of(system.fmu).stepper(width))]
        for motions in (2, 4, 8):
            starts = np.tile(system.start({"x": 0.0, "v": 0.0} if name.endswith("support") else {}), (motions, 1))
            jobs = Jobs(starts, {varied: np.linspace(low, high, motions)}, transient=4000, rows=1)
            calls = [[jobs.part(i, i + 1) for i in range(motions)], *([jobs] for _ in steppers)]
            taken = []
            for stepper, parts in zip([steppers[0], *steppers], calls, strict=True):
                vars(system.backend)["stepper"] = lambda _, one=stepper: one
                made = seconds(lambda one=system, parts=parts: [one.run(jobs, GO) for jobs in parts], repetitions)
                taken.append(made)
            gains = (f"{one.lanes}: {taken[0] / time:.2f}" for one, time in zip(steppers, taken[1:], strict=True))
            cells.append(f"{motions} motions {' '.join(gains)}")
        print(f"{name:24} {'   '.join(cells)}", flush=True)


def chains(repetitions: int) -> None:
    """Gain of sweeps from several starts side by side over one after the other."""
    for name, (forcing, values, varied, (low, high)) in FAMILIES.items():
        system, cells = Strobe(load(name), forcing=forcing, parameters=values), []
        swept = np.linspace(low, high, 200)
        for starts in (1, 2, 4, 8, 16):
            points = np.repeat(system.start({"x": 0.0, "v": 0.0} if name.endswith("support") else {})[None], starts, 0)
            points[1:] += np.random.default_rng(0).uniform(0.0, 0.1, points[1:].shape) * system.sizes()
            how: dict[str, Any] = {"transient": 250, "rows": 50, "longest": 24, "chain": swept.size}
            alone = Jobs(np.repeat(points, swept.size, 0), {varied: np.tile(swept, starts)}, **how)
            turn = Jobs(np.tile(points, (swept.size, 1)), {varied: np.repeat(swept, starts)}, beside=starts, **how)
            after, together = (
                seconds(lambda one=system, jobs=jobs: one.run(jobs, GO), repetitions) for jobs in (alone, turn)
            )
            per_step = 1e9 * together / system.run(turn, GO).steps.sum()
            cells.append(f"{starts}: {after / together:.2f} ({per_step:.0f} ns)")
        print(f"{name:24} sweeps {'   '.join(cells)}", flush=True)


def single_runs(repetitions: int) -> None:
    """What the exact flow would save of ``simulate``, which takes the series."""
    for name, (forcing, values, _, _) in FAMILIES.items():
        system = Strobe(load(name), forcing=forcing, parameters=values)
        end, start = 1000.0 * float(system.periods({}, 1)[0]), system.start({})
        jobs = Jobs(start[None], transient=999, rows=1)
        exact, series = (
            seconds(lambda one=one, jobs=jobs: one.run(jobs, GO), repetitions)
            for one in (system, system.stepped_by("taylor"))
        )
        cells = []
        for samples in (1, 10, 100):
            times = np.linspace(0.0, end, 1000 * samples + 1)
            whole = seconds(lambda one=system, point=start, at=times: one.trajectory(point, at), repetitions)
            cells.append(f"{samples}: {1.0 / (1.0 - min(series / whole, 1.0) * (1.0 - exact / series)):.2f}")
        print(f"{name:24} series {series / exact:.1f}   at most {'   '.join(cells)}", flush=True)


def main(repetitions: int) -> None:
    for system, jobs in families():
        series = system.stepped_by("taylor")
        few = dataclasses.replace(jobs, transient=9)
        known, work = lanes_of(system.fmu), MOTIONS * PERIODS
        base = 1e9 * seconds(lambda one=series, jobs=jobs: one.run(jobs, GO), 1 + repetitions // 3) / work
        cells = []
        for width in (8, 4, 2, 1):
            stepper = known.stepper(width)
            if stepper is not None:
                vars(system.backend)["stepper"] = lambda _, one=stepper: one
                taken = 1e9 * seconds(lambda one=system, jobs=jobs: one.run(jobs, GO), repetitions) / work
                cells.append(f"{width}: {taken:5.0f} ({base / taken:4.1f})")
        vars(system.backend).pop("stepper")
        plain, derived, grown = (
            seconds(lambda one=system, jobs=jobs: one.run(jobs, GO), repetitions)
            for jobs in (
                jobs,
                dataclasses.replace(jobs, derivatives=True),
                dataclasses.replace(jobs, tangents=system.dimension),
            )
        )
        cells.append(f"tangents {derived / plain:.2f}, {grown / plain:.2f}")
        made, other = system.run(few, GO).points[:, 0], series.run(few, GO).points[:, 0]
        errors = np.abs(made - other).max(axis=1) / np.abs(other).max()
        left = 1.0 - system.run(jobs, GO).in_lanes.sum() / work
        print(f"{system.name:24} series {base:5.0f}   {'   '.join(cells)}   left {100.0 * left:.2f} %", end="   ")
        print(f"difference {np.median(errors):.1e}, {errors.max():.1e}", flush=True)


if __name__ == "__main__":
    repetitions = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    main(repetitions)
    few_motions(repetitions)
    chains(repetitions)
    single_runs(repetitions)
