"""The emulated logs of machines in data/ are what the code that made them makes."""

from __future__ import annotations

import numpy as np
import pytest
from checkout import ROOT
from machine_examples import EXAMPLES

from rig_io.readers import read_table

DATA = ROOT / "data" / "machines"


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_log_is_made_anew(name: str) -> None:
    kept, made = read_table(DATA / f"{name}.csv"), EXAMPLES[name]()
    assert set(kept.columns) == set(made)
    for column, values in made.items():
        # one step of the last digit where rounding differs between processors
        step = {"time": 0.0, "position": 1e-3, "force": 1e-2, "friction": 1e-4}.get(column, 1e-5)
        np.testing.assert_allclose(kept.columns[column], values, rtol=0, atol=1.001 * step + 1e-12)
        assert np.mean(np.abs(kept.columns[column] - values) > 1e-9) < 0.01


def test_every_log_that_comes_along_is_made_here() -> None:
    assert {path.stem for path in DATA.glob("*.csv")} == set(EXAMPLES)
    assert all(path.stat().st_size < 200_000 for path in DATA.iterdir())
