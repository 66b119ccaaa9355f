"""Which portraits of a report are live: what cannot move is named, and nothing is compiled for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_fit import made_fit

import identification.report.live as live
from identification.fit.parts import FittedParameter
from identification.fit.result import FrictionFit
from identification.model_check.families import FamilyComparison
from identification.model_check.portraits import PortraitComparison, Rest, Settling, compare_motions

REST = Rest(0.1, 0.0)
MEMBER = PortraitComparison("slow", {"disc0": 0.41}, REST, REST, compare_motions(REST, REST), length=10.0, step=1e-3)


@pytest.fixture(autouse=True)
def never(monkeypatch: pytest.MonkeyPatch) -> None:
    def compiled(_: object) -> bytes:
        raise AssertionError("a model was compiled for what cannot move")

    monkeypatch.setattr(live, "wasm", compiled)


def of_bristles() -> FrictionFit:
    conti = made_fit()
    added = {"sigma0": 1e5, "sigma1": 300.0}
    more = tuple(FittedParameter(n, v, "N/m", 1e-3, 1e-3, 0.0, 0.0, 1e9, False) for n, v in added.items())
    parameters = (*conti.parameters, *more)
    correlation = tuple(map(tuple, np.eye(len(parameters)).tolist()))
    return replace(conti, law="LuGre", parameters=parameters, correlation=correlation)


def test_a_log_that_begins_before_it_has_settled_is_not_live() -> None:
    late = replace(MEMBER, settling=Settling(3.0, None))
    told = live.live_frame(made_fit(), [FamilyComparison((late,), "disc0", None, ())])
    assert told.html == ""
    assert told.notes == ("Not among the live portraits, for it begins before it has settled: slow.",)


def test_portraits_of_a_law_with_bristles_are_not_live() -> None:
    told = live.live_frame(of_bristles(), [FamilyComparison((MEMBER,), "disc0", None, ())])
    assert told.html == ""
    assert told.notes == ("The portraits are not live: the law 'LuGre' has bristles, whose motion takes too long.",)
