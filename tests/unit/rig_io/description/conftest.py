"""A log that is described."""

from __future__ import annotations

from pathlib import Path

import pytest
from bench_columns import SAID, bench_log, written

from rig_io.description.draft import draft, write


@pytest.fixture
def described(tmp_path: Path) -> Path:
    log = bench_log()
    path = written(
        tmp_path, "Zeit [ms];Weg [V];Geber;Antrieb", [1e3 * log["time"], log["laser"], log["encoder"], log["drive"]]
    )
    write(draft([path], SAID))
    return path
