"""The engine watches the balance of energy at its events: engines made wrong on purpose are caught by it."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from mechanisms import crank_without_rod, opened

from fmu_models.base.errors import StickslipError
from fmu_models.codegen import contents
from fmu_models.oscillators import load
from fmu_models.simulation.run import simulate
from fmu_models.toolchain.compiler import engine_sources

# impacts that change the energy: those of the start value go back as fast as they came
FALL = {"x": 2.0, "v": 0.0}


def break_engine(monkeypatch: pytest.MonkeyPatch, *changes: tuple[str, str, str]) -> None:
    """Build what follows with some lines of the engine replaced: (file, line, other line)."""
    texts = engine_sources()
    for file, line, other in changes:
        assert texts[file].count(line) == 1
        texts[file] = texts[file].replace(line, other)
    monkeypatch.setattr(contents, "engine_sources", lambda: texts)


@pytest.mark.parametrize("F", [0.0, 0.3])
def test_a_contact_that_holds_without_a_lever_is_caught(F: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """As if the question were whether the lever is zero, where it is rounding: the crank would stop dead."""
    lever = "return model_lever(r->at.p, r->at.d, &r->scratch, c) > r->tolerances.slip;"
    break_engine(
        monkeypatch,
        ("events/contact_placement.c", lever, "return r->scratch.G[c][c][0] != 0.0;"),
        ("events/mode_selection.c", "beyond && lever > r->tolerances.lever", "beyond && lever >= 0.0"),
    )
    with pytest.raises(StickslipError, match=r"energy is not kept at t = .*'slider'.*next to no lever"):
        simulate(opened(crank_without_rod()), 10.0, parameters={"F": F}, start={"q": 1.0, "w": 1.0})


@pytest.mark.nightly_for("1.000001")
@pytest.mark.parametrize("part", ["0.999", "1.000001"])
def test_impulses_that_do_not_do_their_work_are_caught(part: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """On a table that moves."""
    line = "at->x[MODEL_NQ + v] += j->W[v][c][0] * impulse[c];"
    break_engine(monkeypatch, ("step/contact_forces.c", line, line.replace(";", f" * {part};")))
    with pytest.raises(StickslipError, match=r"energy is not kept at t = .* an impact changes the kinetic energy"):
        simulate(opened(load("bouncing_ball")), 10.0, start=FALL)


@pytest.mark.nightly_for("changes0")
@pytest.mark.parametrize("changes", [(), (("model/run_state.c", ".energy = 1e-9", ".energy = 1e-15"),)])
def test_sound_impacts_have_room_to_spare(changes: Sequence[tuple[str, str, str]], monkeypatch) -> None:
    """A bound a million times as narrow would do."""
    break_engine(monkeypatch, *changes)
    assert simulate(opened(load("bouncing_ball")), 10.0, start=FALL).events
