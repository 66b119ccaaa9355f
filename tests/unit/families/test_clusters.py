"""Chunks that the workers of a cluster make are those that threads make; workers that die are survived."""

from __future__ import annotations

import os
import pickle
import signal
from functools import cache

import numpy as np
import pytest
from store_content import content
from test_stores import CHAOS, LINE, LOGISTIC, SMALL, SUPPORT, mapped

from fmu_models.analyses.chart import chart
from fmu_models.base.errors import StickslipError
from fmu_models.base.version import version
from fmu_models.families import cluster
from fmu_models.families import jobs as families
from fmu_models.families.cluster import packed, run_part
from fmu_models.families.execution import Execution
from fmu_models.families.jobs import Jobs
from fmu_models.sections.return_map import ReturnMap
from fmu_models.sections.strobe import Strobe
from fmu_models.simulation.sections import Section

distributed = pytest.importorskip("distributed")

JOBS = Jobs(np.array([[0.1, 0.2], [1.0, -0.5]]), rows=3)


@cache
def system() -> Strobe:
    return Strobe(SUPPORT, forcing="omega", parameters=CHAOS)


@pytest.mark.filterwarnings("default")  # those of distributed about workers that are lost
def test_two_workers_of_which_one_is_killed_write_the_same_store(tmp_path, monkeypatch):
    for name in ("FAR_CHUNK", "MOST_CHUNK"):
        monkeypatch.setattr(families, name, SMALL)
    plain = mapped(store=tmp_path / "threads.zarr")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as made:
        alive = [worker.process.pid for worker in made.workers.values()]

        def kill_one(fraction: float) -> None:
            if fraction > 0.2 and len(alive) == 2:
                os.kill(alive.pop(), signal.SIGKILL)

        found = mapped(store=tmp_path / "cluster.zarr", scheduler=made.scheduler_address, progress=kill_one)
        assert len(alive) == 1 and np.array_equal(found.labels, plain.labels)
        failing = chart(
            Strobe(SUPPORT, forcing="omega"),
            omega=[0.9],
            m=[1.0, 2.0],
            transient=60,
            execution=Execution(scheduler=made.scheduler_address),
        )
        assert failing.labels.shape == (1, 2)
    assert content(tmp_path / "cluster.zarr") == content(tmp_path / "threads.zarr")


def test_what_travels_is_checked_and_runs_as_here():
    there = run_part(version(), packed(system())[0], JOBS, SUPPORT.path.read_bytes())
    assert np.array_equal(there.points, system().run(JOBS, np.zeros(1, np.int32)).points)
    with pytest.raises(StickslipError, match="did not arrive whole"):
        run_part(version(), packed(system().at(ks=200.0))[0], JOBS)
    with pytest.raises(StickslipError, match=r"has stickslip .*, not 0\.0"):
        run_part("0.0", packed(system())[0], JOBS)
    jobs = Jobs(np.array([[0.3]]), rows=4)
    assert np.array_equal(
        run_part(version(), packed(LOGISTIC)[0], jobs).points, LOGISTIC.run(jobs, np.zeros(1, np.int32)).points
    )


def test_systems_can_be_pickled():
    back = ReturnMap(SUPPORT, "v", section=Section("x", 0.0, 1), cap=50.0, start={"x": 0.0})
    assert pickle.loads(pickle.dumps(back))(1.0) == back(1.0)
    assert np.array_equal(pickle.loads(pickle.dumps(system())).make(JOBS).points, system().make(JOBS).points)


def test_where_nobody_answers_that_is_said(monkeypatch):
    monkeypatch.setattr(cluster, "WAIT", 0.3)
    with pytest.raises(StickslipError, match=r"No scheduler answers at 'tcp://127\.0\.0\.1:9'"):
        chart(system(), omega=LINE[6:7], m=[1.0], execution=Execution(scheduler="tcp://127.0.0.1:9"))
