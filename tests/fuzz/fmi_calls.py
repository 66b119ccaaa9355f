"""The functions of generated models, called by a confused importer."""

from __future__ import annotations

import math
import random
from functools import cache

from faces import face
from fuzzing import Target
from random_calls import ERROR, OK, WiderCaller

from fmu_models.codegen.package import FMI_VERSIONS, built
from fmu_models.fmu.fmu import Fmu

# friction with stick, compliant stops that remember, impacts with friction: what contacts there are
MODELS = ("forced_stick_slip", "discontinuous_support", "woodpecker")
CALLS = 60


def _prepare() -> None:
    for model in MODELS:
        for version in FMI_VERSIONS:
            built(model, fmi_version=version)


@cache
def _opened(model: str, version: str) -> Fmu:
    return Fmu.open(built(model, fmi_version=version))


def _case(generator: random.Random) -> None:
    """A new instance and some calls; whatever they were, it is as good as new after a reset."""
    fmu = _opened(generator.choice(MODELS), generator.choice(FMI_VERSIONS))
    with face(fmu, co_simulation=generator.random() < 0.6) as one:
        caller = WiderCaller(one, generator)
        for _ in range(CALLS):
            said = len(one.messages)
            call = generator.choice(caller.calls)
            status = call()
            assert status in (OK, ERROR), f"{call.__name__} returns {status}"
            assert status == OK or len(one.messages) > said, f"{call.__name__} fails without a word"
        one.api.reset()
        one.initialize()
        assert all(math.isfinite(x) for x in one.get(fmu.states))


CALLS_OF_FMI = Target("calls", _case, _prepare, native=True, weight=3)
