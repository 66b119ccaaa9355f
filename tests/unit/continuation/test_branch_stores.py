"""Stores of branches: the same to the last byte however often they are broken off."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from checkout import ROOT
from lazy_fmu import LazyFmu
from store_content import content

from fmu_models import Execution, StickslipError, Strobe
from fmu_models.continuation import begin as begins
from fmu_models.continuation.branches import Branches, branch, branches
from fmu_models.continuation.problem.flow import FlowProblem
from fmu_models.families.store import RunLog

xarray = pytest.importorskip("xarray")
pytest.importorskip("zarr")

HELPERS = str(ROOT / "tests/helpers")
FMU = LazyFmu("discontinuous_support")


def support() -> Strobe:
    return Strobe(FMU, forcing="omega", parameters={"ks": 300.0, "omega": 0.93})


def quiet(fraction: float) -> None: ...


def followed(progress: Any = quiet, **execution: Any) -> Branches:
    """Over a flip and a grazing, and the branch of twice the period."""
    return branches(support(), "omega", (0.93, 0.98), longest=2, execution=Execution(**execution), progress=progress)


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("whole") / "run.zarr"
    followed(store=path)
    return path


def links(store: Path) -> int:
    """Pieces that are there."""
    (path,) = [*store.glob("records.log"), *store.glob("records/log/c/0")]
    return len(RunLog(path).numbers)


def test_a_store_holds_what_is_found_without_it(whole):
    plain = followed().to_xarray()
    kept = xarray.open_zarr(whole, consolidated=False, chunks=None).drop_attrs()
    assert np.array_equal(kept["omega"], plain["omega"]) and np.array_equal(kept["x"], plain["x"])
    assert kept["special_kind"].values.tolist() == plain["special_kind"].values.tolist()
    assert {"flip", "grazing, compliant"} <= set(kept["special_kind"].values.tolist())
    assert links(whole) > 5


@pytest.mark.skipif(sys.platform == "win32", reason="no kill -9 there")
def test_what_is_killed_goes_on_to_the_same_bytes(whole, tmp_path):
    """Each child follows some ninety motions more and is killed; the last one comes to the end."""
    store = tmp_path / "run.zarr"
    code = (
        "import os, sys\n"
        f"sys.path[:0] = {[str(Path(__file__).parent), str(ROOT), str(ROOT / 'tests/helpers')]!r}\n"
        "import test_branch_stores as t\n"
        "from fmu_models.continuation.step.way import Way\n"
        "told, add = [], Way.add\n"
        "def counted(self, node):\n"
        "    told.append(add(self, node))\n"
        "    if len(told) > 90: os.kill(os.getpid(), 9)\n"
        "Way.add = counted\n"
        f"t.followed(store={str(store)!r}, resume=True)\n"
    )
    children, kept = [killed(code)], [links(store)]
    while children[-1].returncode == -signal.SIGKILL:
        children.append(killed(code))
        kept.append(links(store))
    assert children[-1].returncode == 0, children[-1].stderr
    assert 1 < len(children) < 6 and kept == sorted(set(kept))
    assert content(store) == content(whole)


def killed(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)


def test_an_interrupt_before_the_first_motion_is_found(whole, tmp_path, monkeypatch):
    store = tmp_path / "run.zarr"

    def interrupted(*_: Any, **__: Any) -> Any:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(begins, "solved", interrupted)
        with pytest.raises(KeyboardInterrupt) as caught:
            followed(store=store)
    assert "Go on: --resume" in caught.value.__notes__[0]
    with pytest.raises(StickslipError, match=r"is not finished\. Go on with it: --resume"):
        followed(store=store)
    followed(store=store, resume=True)
    assert content(store) == content(whole)


def test_an_interrupt_later_says_how_to_go_on(whole, tmp_path):
    store, told = tmp_path / "run.zarr", []

    def progress(fraction: float) -> None:
        told.append(fraction)
        if len(told) == 40:
            signal.raise_signal(signal.SIGINT)

    found = followed(store=store, progress=progress)
    assert found.interrupted and "Go on: --resume" in str(found.branches[0].ends) and links(store) > 1
    followed(store=store, resume=True)
    assert content(store) == content(whole)


def test_a_finished_store_is_read(whole, monkeypatch):
    before = content(whole)
    monkeypatch.setattr(FlowProblem, "rephased", lambda *_: pytest.fail("a motion was followed"))
    read = followed(store=whole)
    assert content(whole) == before and len(read.branches) == 2 and len(read.special) > 5


def test_a_store_of_another_branch_is_refused(whole):
    with pytest.raises(StickslipError, match=r"between = \[0\.93, 0\.98\] there, \[0\.93, 0\.99\] here"):
        branches(support(), "omega", (0.93, 0.99), longest=2, execution=Execution(store=whole))
    with pytest.raises(StickslipError, match="switch = true there, false here"):
        branch(support(), "omega", (0.93, 0.98), execution=Execution(store=whole))
