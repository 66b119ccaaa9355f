"""The master beside others on the same FMUs, which another importer drives: fewer calls, and the error asked for."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest
from benchmark_scripts import benchmark_script


@pytest.mark.nightly
def test_beside_step_doubling_and_ecco(tmp_path: Path) -> None:
    bench = benchmark_script("bench_cosimulation")
    case = bench.cases(tmp_path)["loop"]
    calls, error = bench.ours(case, 1e-3)
    assert error <= 3e-3
    others = [bench.doubling, *[bench.ecco] * (importlib.util.find_spec("libcosimpy") is not None)]
    for other in others:
        their_calls, their_error = other(case, 1e-3)
        assert their_calls > 5 * calls
        # they come to the same motion, with errors that held inputs leave
        assert error < their_error < 0.2
