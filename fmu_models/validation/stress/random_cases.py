"""Cases drawn at random: parameters, starts and drives around what the declaration gives, each from a seed alone.

    parameter    kept, or its default times a power of two up to 2^1.5 either way; a restitution from 0 to 1; what is
                 zero by default stays zero
    start        states on the default motion, at another time for each case; then every state moved by up to half of
                 its range on that motion, now and then by more
    input        its default times a number from -1.5 to 2
    length       a third to two characteristic periods

All numbers have six digits, so that a command line repeats a case to the last bit.
"""

from __future__ import annotations

import random
from collections.abc import Mapping

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from fmu_models.validation.stress.cases import Case, characteristic_period
from fmu_models.validation.stress.equations import Equations
from fmu_models.validation.stress.roles import Model, roles

RANDOM = "random"  # what such a case is about
PERIODS = 3.0  # of the default motion that starts are taken from
OCTAVES = 1.5
SAMPLES = 201


def random_cases(
    name: str, model: Model, fmu: Fmu, equations: Equations, count: int, seed: int, *, until: float | None = None
) -> list[Case]:
    """The first ``count`` random cases of a model; ``until`` replaces the length of each, s."""
    period = characteristic_period(model, equations)
    motion = _motion(fmu, equations, until or PERIODS * period)
    restitutions = {role.name for role in roles(model) if role.does == "restitution"}
    found = []
    for number in range(count):
        draw = random.Random(f"{seed}/{name}/{number}")
        length = until or _short(period * draw.uniform(1 / 3, 2.0))
        found.append(
            Case(
                name,
                RANDOM,
                "",
                f"{RANDOM} {seed}/{number}",
                parameters={n: v for n, v in _parameters(fmu, equations, restitutions, draw).items()},
                start=_start(motion, draw),
                inputs={n: _short(v * draw.uniform(-1.5, 2.0)) for n, v in equations.inputs.items()},
                duration=length,
            )
        )
    return found


def command_line(case: Case) -> str:
    """What repeats the run of a case in a shell."""
    parts = [f"stickslip simulate {case.model}"]
    for option, values in (("--set", case.parameters), ("--start", case.start), ("--input", case.inputs)):
        parts += [f"{option} {name}={value!r}" for name, value in values.items()]
    return " ".join([*parts, f"--until {case.duration!r}"])


def _short(value: float) -> float:
    return float(f"{value:.6g}")


def _motion(fmu: Fmu, equations: Equations, length: float) -> Mapping[str, np.ndarray]:
    """Each state over the default motion (SAMPLES,); its start where there is no such motion."""
    try:
        run = simulate(fmu, length, output_times=np.linspace(0.0, length, SAMPLES))
    except StickslipError:
        return {name: np.full(SAMPLES, value) for name, value in equations.starts.items()}
    return {name: run[name] for name in equations.starts}


def _parameters(fmu: Fmu, equations: Equations, restitutions: set[str], draw: random.Random) -> dict[str, float]:
    """Those that differ from their defaults, within their bounds."""
    found = {}
    for name, default in equations.parameters.items():
        if draw.random() < 0.5 or default == 0.0:
            continue
        value = draw.uniform(0.0, 1.0) if name in restitutions else default * 2.0 ** draw.uniform(-OCTAVES, OCTAVES)
        variable = fmu.variables[name]
        low, high = (None if bound is None else float(bound) for bound in (variable.min, variable.max))
        value = _short(value)
        value = value if low is None else max(value, low)
        found[name] = value if high is None else min(value, high)
    return found


def _start(motion: Mapping[str, np.ndarray], draw: random.Random) -> dict[str, float]:
    """A state of the default motion, moved."""
    at = draw.randrange(SAMPLES)
    reach = draw.choice((0.0, 0.1, 0.5, 0.5, 2.0))
    found = {}
    for name, values in motion.items():
        size = float(np.ptp(values)) or float(np.abs(values).max()) or 1.0
        found[name] = _short(float(values[at]) + reach * size * draw.uniform(-1.0, 1.0))
    return found
