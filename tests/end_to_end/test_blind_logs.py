"""CSV files of benches that nobody knows, described by what a user can say and fitted by the command."""

from __future__ import annotations

from pathlib import Path

import pytest
from benchmark_scripts import benchmark_script


@pytest.mark.nightly_for("1", "8", "12", "13", "15")
@pytest.mark.parametrize("number", [2, 1, 8, 12, 13, 15])
def test_a_blind_log_is_fitted_at_once_and_what_is_wrong_is_named(number: int, tmp_path: Path, monkeypatch) -> None:
    """2, 1, 15: another beam than is said, by edges with times; 8: wear; 12: a normal force that sways, counts alone at
    250 Hz; 13: a bent spring, and slips whose starts are next to stick."""
    monkeypatch.chdir(tmp_path)
    script = benchmark_script("bench_blind_logs")
    outcome = script.judged(script.Blind(number), tmp_path / "bench")
    bench = outcome.bench
    assert outcome.right and not outcome.false and not outcome.held < 2, outcome
    assert outcome.beam == (bench.beam if bench.told != bench.beam else "")
    assert not bench.disturbance or any(bench.disturbance in named.split("/") for named in outcome.named)
