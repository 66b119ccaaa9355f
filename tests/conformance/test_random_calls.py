"""Calls in any order with any arguments: every one returns a status, errors come with a reason, and nothing crashes."""

from __future__ import annotations

import math
import random

import pytest
from faces import face
from random_calls import Caller

from fmu_models.fmu.fmu import Fmu

CALLS = 300


@pytest.mark.parametrize("co_simulation", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_any_calls_in_any_order(fmu: Fmu, co_simulation: bool, seed: int) -> None:
    with face(fmu, co_simulation=co_simulation) as one:
        caller = Caller(one, random.Random(seed))
        done = {0: 0, 3: 0}
        for _ in range(CALLS):
            said = len(one.messages)
            call = caller.random.choice(caller.calls)
            status = call()
            assert status in done, call
            assert (len(one.messages) > said) or status == 0, call
            done[status] += 1
        # neither refusing everything nor accepting everything
        assert min(done.values()) > CALLS / 10
        # and the instance is as good as new
        one.api.reset()
        one.initialize()
        assert [math.isfinite(x) for x in one.get(fmu.states)] == [True] * len(fmu.states)
