"""Who makes a search, and what is left of one that was interrupted."""

from __future__ import annotations

import pickle

import lmfit
import numpy as np
import pytest
from noisy_belt import FREE, OFF, noisy

from fmu_models.base.errors import StickslipError
from fmu_models.base.version import version
from fmu_models.families.cluster import packed, run_part
from fmu_models.families.execution import Execution
from fmu_models.families.jobs import Jobs
from identification.calibration.calibrate import calibrate
from identification.calibration.log import model_log
from identification.calibration.nodes import Nodes
from identification.calibration.pose import Settings, problem_of
from identification.calibration.search import Plan, Search
from identification.calibration.subject import Stretch, Window
from identification.calibration.systems import opened, subject_of
from identification.calibration.ties import TiedSubject, of_lmfit


def test_processes_and_stores_give_the_same_and_an_interrupt_goes_on(belt, found, tmp_path, monkeypatch):
    """Interrupted in its first descent, after the scan: what is handed over is no minimum, is told, and is not kept as
    one; afterwards nothing is scored anew."""
    log, store = noisy(belt, 3), tmp_path / "search.zarr"

    def interrupt(done: float) -> None:
        if done > 0.3:
            raise KeyboardInterrupt

    cut = calibrate(belt, log, free=FREE, parameters=OFF, execution=Execution(1, store=store), progress=interrupt)
    assert cut.interrupted and any("--resume" in warning for warning in cut.warnings)
    assert cut.method.startswith("run of") and cut.values != found.values
    with pytest.raises(StickslipError, match="is not finished"):
        calibrate(belt, log, free=FREE, parameters=OFF, execution=Execution(1, store=store))
    with pytest.raises(StickslipError, match=r"first\.k = "):
        calibrate(belt, log, free=FREE, parameters={**OFF, "k": 1.2}, execution=Execution(1, store=store, resume=True))
    monkeypatch.setattr(Nodes, "rolled", None)
    again = calibrate(belt, log, free=FREE, parameters=OFF, execution=Execution(2, store=store, resume=True))
    assert again.values == found.values and not again.interrupted


@pytest.mark.parametrize("kind", ["own", "map", "coupled", "tied"])
def test_a_subject_travels_by_what_it_was_made_from(belt, kind):
    if kind == "map":
        subject = subject_of(opened("henon"), ["a"], ["x"])
        stretch = Stretch(Window(0.0, np.arange(1.0, 6.0), {}), {"a": 1.2, "b": 0.3}, {"x": 0.1, "y": 0.1})
    elif kind == "coupled":
        subject = subject_of(opened("disc_rig_motors"), ["motor1.K"], ["rig.theta"])
        start = {name: subject.fmu.start_of(name) for name in subject.states}
        stretch = Stretch(Window(0.0, np.array([0.1, 0.2]), {}), {"motor1.K": 1.5}, start)
    else:
        subject = subject_of(belt, ["a1", "a0"], ["x"])
        if kind == "tied":
            parameters = lmfit.Parameters()
            parameters.add("a1", value=1.2)
            parameters.add("a0", expr="a1")
            subject = TiedSubject(subject, of_lmfit(belt, parameters)[1]["ties"])
        stretch = Stretch(Window(0.0, np.arange(1.0, 6.0), {}), {"a1": 1.2, "a0": 1.4}, {"x": 1.0, "v": 0.1})
    there = pickle.loads(pickle.dumps(subject))
    np.testing.assert_array_equal(there.respond(stretch).slopes, subject.respond(stretch).slopes)
    assert there.fmu.sha256 == subject.fmu.sha256


def test_workers_of_a_cluster_score_and_descend_as_here(belt):
    pytest.importorskip("distributed")
    settings = Settings(parameters=OFF)
    problem, sought = problem_of(belt, [model_log(noisy(belt, 3), belt)], FREE, settings)
    asked = Search(problem, sought, Plan(guesses=2)).trials
    parcel, fmus = packed(asked)
    assert fmus == [belt]
    guess, stop = problem.first, np.zeros(1, np.int32)
    scored = asked.run(Jobs(guess[None]), stop).points[0]
    there = run_part(version(), parcel, Jobs(guess[None]), belt.path.read_bytes()).points[0]
    np.testing.assert_array_equal(there, scored)
    row = Jobs(np.append(guess, scored[0, 1:])[None])
    here, there = asked.run(row, stop), run_part(version(), parcel, row, belt.path.read_bytes())
    np.testing.assert_array_equal(there.points, here.points)
    assert asked.minimum(row.starts[0], there).misfit == asked.minimum(row.starts[0], here).misfit
