"""Importers that are less careful than they should be get the motion all the same, or are told why not."""

from __future__ import annotations

import itertools
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from careless_importer import Habits, Importer
from faces import face

from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate

# a stick-slip motion, a compliant stop, one that remembers, bounces, friction with impacts
MODELS = ("disc_rig", "discontinuous_support", "hinge_clearance", "bouncing_ball", "woodpecker")
VALUES = {"disc_rig": {"w0": 0.41}}
# end and step of the runs, s; the spring of the woodpecker is stiff
STOP, STEP = {"woodpecker": 0.75}, {"woodpecker": 1 / 4096}


@pytest.fixture(scope="module", params=list(itertools.product(MODELS, ("2.0", "3.0"))), ids="-".join)
def some(request: pytest.FixtureRequest) -> tuple[str, Fmu]:
    model, version = request.param
    return model, Fmu.open(built(model, fmi_version=version))


def run(some: tuple[str, Fmu], **habits: object) -> tuple[np.ndarray, Importer]:
    model, fmu = some
    importer = Importer(fmu, Habits(**{"step": STEP.get(model, 1 / 256), **habits}))  # pyright: ignore[reportArgumentType]
    return importer.run(STOP.get(model, 3.0), VALUES.get(model)), importer


def distance(some: tuple[str, Fmu], rows: np.ndarray, step: float) -> float:
    """Root of the mean square of the error against our own run, in nominal values: no row counts alone."""
    model, fmu = some
    inputs = {k: v for k, v in VALUES.get(model, {}).items() if k in fmu.inputs}
    times = np.arange(len(rows)) * step
    exact = simulate(fmu, times[-1], inputs=inputs, output_times=times)
    nominal = np.array([float(fmu.variables[name].nominal or 1.0) for name in fmu.states])
    errors = (rows - np.array([exact[name] for name in fmu.states]).T) / nominal
    return float(np.sqrt(np.mean(errors**2)))


@pytest.fixture(scope="module")
def plain(some: tuple[str, Fmu]) -> np.ndarray:
    rows, importer = run(some)
    assert importer.events > 0
    return rows


def test_a_careful_importer_agrees(some: tuple[str, Fmu], plain: np.ndarray) -> None:
    assert distance(some, plain, STEP.get(some[0], 1 / 256)) < 5e-6


@pytest.mark.parametrize("habit", ["completes", "probes", "rolls_back"])
def test_calls_that_should_not_matter_do_not(some: tuple[str, Fmu], plain: np.ndarray, habit: str) -> None:
    rows, _ = run(some, **{habit: True})
    np.testing.assert_array_equal(rows, plain)


def test_an_importer_that_starts_anew_only_when_told_is_told_at_every_event(some: tuple[str, Fmu]) -> None:
    always, importer = run(some, method="adams", restarts="always")
    told, _ = run(some, method="adams", restarts="told")
    assert importer.told == importer.events
    np.testing.assert_array_equal(told, always)
    never, _ = run(some, method="adams", restarts="never")
    assert not np.array_equal(never, always)  # so that it matters


def test_instances_in_threads_do_not_meet(some: tuple[str, Fmu], plain: np.ndarray) -> None:
    with ThreadPoolExecutor(4) as pool:
        for rows in pool.map(lambda _: run(some)[0], range(4)):
            np.testing.assert_array_equal(rows, plain)


def test_a_bounce_that_is_located_a_step_late_is_resolved_where_it_was() -> None:
    some = "bouncing_ball", Fmu.open(built("bouncing_ball"))
    assert distance(some, run(some, locates=False, step=1 / 64)[0], 1 / 64) < 1e-12


@pytest.mark.nightly_for("woodpecker-2.0", "woodpecker-3.0")
def test_events_a_step_late_cost_an_error_that_goes_with_the_step(some: tuple[str, Fmu]) -> None:
    step = 2.0 * STEP.get(some[0], 1 / 256)
    coarse, fine = (distance(some, run(some, locates=False, step=h)[0], h) for h in (step, step / 16))
    assert fine < 0.25 * coarse or max(coarse, fine) < 1e-9


def test_every_order_of_inputs_gives_the_same(some: tuple[str, Fmu]) -> None:
    _, fmu = some
    names = [name for name in fmu.variables if fmu.variables[name].causality == "input"]
    if not names:
        pytest.skip("the model has no input")
    found = set()
    for order in itertools.permutations(names):
        with face(fmu, co_simulation=False) as f:
            f.initialize()
            f.update()
            f.api.enterContinuousTimeMode()
            f.api.setTime(0.1)
            f.api.enterEventMode()
            for name in order:
                f.set({name: 0.1 * (1 + names.index(name))})
            f.update()
            f.api.enterContinuousTimeMode()
            found.add((tuple(f.derivatives()), tuple(f.contact_states())))
    assert len(found) == 1


def test_references_may_be_taken_for_indices_and_outputs_for_real_numbers(some: tuple[str, Fmu]) -> None:
    _, fmu = some
    names = list(fmu.variables)
    # an output that is the same quantity as one before shares its reference; the place of no other changes by that
    references = [fmu.variables[name].valueReference for name in names]
    shared = {place for place, reference in enumerate(references) if reference in references[:place]}
    assert [r for place, r in enumerate(references) if place not in shared] == [
        place + 1 for place in range(len(names)) if place not in shared
    ]
    assert all(fmu.variables[names[place]].causality == "output" for place in shared)
    description = fmu.description
    unknowns = [*description.outputs, *description.derivatives, *description.initialUnknowns]
    assert all(d is not None for u in unknowns for d in u.dependencies or ())
    outputs = [name for name in names if fmu.variables[name].causality == "output"]
    with face(fmu, co_simulation=False) as f:
        f.initialize()
        assert np.isfinite(f.get(outputs)).all()


@pytest.mark.parametrize("locates", [True, False])
def test_steps_of_a_hundredth_by_the_method_of_euler_come_to_an_end(some: tuple[str, Fmu], locates: bool) -> None:
    importer = Importer(some[1], Habits(step=0.01, method="euler", locates=locates))
    assert np.isfinite(importer.run(10.0, VALUES.get(some[0]))).all()
