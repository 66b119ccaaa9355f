"""Windows of the weak form: how far apart they are."""

from __future__ import annotations

import numpy as np
import pytest

from identification.estimators.windows import stride_of, windows

STEP, PERIOD = 1e-3, 1.0  # 22 samples between windows


@pytest.mark.parametrize(
    ("spare", "stride", "rows"), [(0, 1, 1), (1, 1, 2), (30, 30, 2), (34, 17, 3), (220, 22, 11), (1100, 22, 51)]
)
def test_windows_reach_from_the_begin_of_a_slip_to_its_end(spare: int, stride: int, rows: int) -> None:
    found = windows(np.arange(spare + 50.0), 50, stride_of(spare, STEP, PERIOD))
    assert stride_of(spare, STEP, PERIOD) == stride and len(found) == rows
    assert found[0, 0] == 0 and found[-1, -1] == spare + 49


def test_windows_of_coarse_samples_begin_at_each() -> None:
    assert stride_of(7, 30 * STEP, PERIOD) == 1
