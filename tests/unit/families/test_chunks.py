"""Chunks of families are worth the while, few, and hold no more than memory has room for."""

import numpy as np
import pytest

from fmu_models.families.jobs import CHUNK, CHUNKS, FAR_CHUNK, MOST_CHUNK, ROWS, Jobs


@pytest.mark.parametrize("pace", [1, 8])
@pytest.mark.parametrize("far", [False, True])
def test_chunks_are_worth_the_while_and_few_until_they_are_as_large_as_they_may_be(far, pace):
    least = (FAR_CHUNK if far else CHUNK) * pace
    for count in (10, 10**4, 10**6, 10**9):
        jobs = Jobs(np.broadcast_to(np.zeros(2), (count, 2)), transient=60)
        chunks = jobs.chunks(1, pace, far=far)
        assert [chunk.begin for chunk in chunks] == [0, *(chunk.end for chunk in chunks[:-1])]
        assert chunks[-1].end == count
        steps = 61 * (chunks[0].end - chunks[0].begin)
        assert least - 61 <= steps <= max(least, MOST_CHUNK * pace) or len(chunks) == 1
        assert len(chunks) <= CHUNKS + 1 or steps >= MOST_CHUNK * pace - 61


def test_chunks_that_keep_many_rows_are_smaller():
    jobs = Jobs(np.broadcast_to(np.zeros(2), (10**7, 2)), transient=3000, rows=128, longest=64)
    chunks = jobs.chunks(1, 8)
    assert 128 * (chunks[0].end - chunks[0].begin) == ROWS
