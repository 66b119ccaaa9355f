"""Rows of runs that go to another process, and arrive as they were."""

import pickle
from dataclasses import fields, replace

import numpy as np

from fmu_models.simulation.rows import RunRows


def test_rows_arrive_with_the_same_bits_and_types_from_fewer_bytes():
    random = np.random.default_rng(0)
    rows = RunRows.empty(500, 3, 4, 2, derivatives=(3, 2))
    rows.points[:400] = random.normal(size=(400, 3, 4))
    rows.held[0, 0, 0] = -0.0  # the only one that is not +0.0
    rows.steps[:] = random.integers(0, 70_000, 500)
    rows.orbits[:] = random.integers(-1, 200, 500)
    rows.outcomes[:] = 2
    rows = replace(rows, points=rows.points[..., :-1], times=rows.points[..., -1], messages={3: "a reason"})
    told = pickle.dumps(rows)
    arrived = pickle.loads(told)
    for field in fields(rows):
        sent, there = getattr(rows, field.name), getattr(arrived, field.name)
        if field.name != "messages":
            assert (there.dtype, there.shape, there.tobytes()) == (sent.dtype, sent.shape, sent.tobytes()), field.name
            assert there.flags.writeable
    assert arrived.messages == {3: "a reason"}
    floats = rows.points.nbytes + rows.times.nbytes + rows.held.nbytes
    assert len(told) < floats + 500 * (4 + 2) + 2000
    assert len(pickle.loads(pickle.dumps(rows.only(np.zeros(0, np.int64)))).filled) == 0
