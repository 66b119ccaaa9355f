"""Cases drawn at random: parameters, starts and drives around what the declaration gives, each from a seed alone.

    parameter    kept, or its default times a power of two up to 2^1.5 either way; a restitution from 0 to 1; what is
                 zero by default stays zero. Drawn again where the declaration forbids the values
    start        states on the default motion, at another time for each case; then every state moved by up to half of
                 its range on that motion, now and then by more. Drawn again where it lies inside a wall, or inside a
                 stop that remembers the speed at which it was entered
    input        its default times a number from -1.5 to 2
    length       a third to two characteristic periods

Whether a draw is possible is read from the declaration, never asked of the engine; what stays impossible is a case to
be refused. All numbers have six digits, so that a command line repeats a case to the last bit.
"""

import random
from collections.abc import Mapping

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.values import check_values
from fmu_models.simulation.run import simulate
from fmu_models.validation.stress.cases import Case, characteristic_period
from fmu_models.validation.stress.equations import StressEquations
from fmu_models.validation.stress.roles import Model, roles

RANDOM = "random"  # what such a case is about
PERIODS = 3.0  # of the default motion that starts are taken from
OCTAVES = 1.5
SAMPLES = 201
DRAWS = 100  # of values, and of starts, until they are possible


def random_cases(
    name: str, model: Model, fmu: Fmu, equations: StressEquations, count: int, seed: int, *, until: float | None = None
) -> list[Case]:
    """The first ``count`` random cases of a model; ``until`` replaces the length of each, s."""
    period = characteristic_period(model, equations)
    motion = _motion(fmu, equations, until or PERIODS * period)
    restitutions = {role.name for role in roles(model) if role.does == "restitution"}
    cases = []
    for number in range(count):
        draw = random.Random(f"{seed}/{name}/{number}")
        length = until or _short(period * draw.uniform(1 / 3, 2.0))
        parameters = _parameters(equations, restitutions, draw)
        inputs = {n: _short(v * draw.uniform(-1.5, 2.0)) for n, v in equations.inputs.items()}
        start = _start(motion, equations, parameters | inputs, draw)
        label = f"{RANDOM} {seed}/{number}"
        cases.append(Case(name, RANDOM, "", label, parameters=parameters, start=start, inputs=inputs, duration=length))
    return cases


def command_line(case: Case) -> str:
    """What repeats the run of a case in a shell."""
    arguments = [f"stickslip simulate {case.model}"]
    for option, values in (("--set", case.parameters), ("--start", case.start), ("--input", case.inputs)):
        arguments += [f"{option} {name}={value!r}" for name, value in values.items()]
    return " ".join([*arguments, f"--until {case.duration!r}"])


def _short(value: float) -> float:
    return float(f"{value:.6g}")


def _motion(fmu: Fmu, equations: StressEquations, length: float) -> Mapping[str, np.ndarray]:
    """Each state over the default motion (SAMPLES,); its start where there is no such motion."""
    try:
        run = simulate(fmu, length, output_times=np.linspace(0.0, length, SAMPLES))
    except StickslipError:
        return {name: np.full(SAMPLES, value) for name, value in equations.starts.items()}
    return {name: run[name] for name in equations.starts}


def _parameters(equations: StressEquations, restitutions: set[str], draw: random.Random) -> dict[str, float]:
    """Those that differ from their defaults; fewer and fewer of them where the values contradict one another."""
    values: dict[str, float] = {}
    for attempt in range(DRAWS):
        values = {}
        for name, default in equations.parameters.items():
            if default == 0.0 or draw.random() < 0.5 + 0.5 * attempt / DRAWS:
                continue
            factor = 2.0 ** draw.uniform(-OCTAVES, OCTAVES)
            values[name] = _short(draw.uniform(0.0, 1.0) if name in restitutions else default * factor)
        try:
            check_values(equations.system, values)
            break
        except StickslipError:
            continue
    return values


def _start(
    motion: Mapping[str, np.ndarray], equations: StressEquations, values: Mapping[str, float], draw: random.Random
) -> dict[str, float]:
    """A state of the default motion, moved."""
    state: dict[str, float] = {}
    for _ in range(DRAWS):
        at = draw.randrange(SAMPLES)
        reach = draw.choice((0.0, 0.1, 0.5, 0.5, 2.0))
        for name, states in motion.items():
            size = float(np.ptp(states)) or float(np.abs(states).max()) or 1.0
            state[name] = _short(float(states[at]) + reach * size * draw.uniform(-1.0, 1.0))
        if not _inside(equations, state, values):
            break
    return state


def _inside(equations: StressEquations, start: Mapping[str, float], values: Mapping[str, float]) -> bool:
    """Whether a rigid wall is penetrated, or a stop whose force depends on how it was entered."""
    columns = {name: np.array([value]) for name, value in start.items()} | {"time": np.zeros(1)}
    columns |= {name: np.array([values[name]]) for name in equations.inputs}
    contacts = equations.system.contacts
    columns |= {f"{c.name}_state": np.zeros(1) for c in contacts}
    environment = equations.environment(columns, values)
    return any(
        float(np.squeeze(equations.place(i, environment, "depth")[0])) > 0.0
        for i, contact in enumerate(contacts)
        if contact.depth is not None and (contact.kind.impulsive or contact.remembers)
    )
