"""What a scene says of itself, and of what its FMU does without."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console
from scene_file import CLASS_A, scene_of

from fmu_models.report.scene_summary import print_explained, print_scene
from fmu_models.scene.scene import Drive


class OneDisc:
    """What is asked of the FMU of a scene."""

    contacts = ("disc0",)


def printed(show: Any, *arguments: Any) -> str:
    out = io.StringIO()
    show(*arguments, Console(file=out, width=120, highlight=False))
    return " ".join(out.getvalue().split())


def test_a_drive_is_told_by_its_value_or_as_one_that_varies(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, CLASS_A)
    told = printed(print_scene, scene, OneDisc())
    assert "drives w0 = 0.83" in told and "contacts disc0" in told and "run to t = 5 s" in told
    rising = replace(scene, drives={"w0": Drive(times=(0.0, 5.0), values=(0.1, 0.8))})
    assert "drives w0 varies" in printed(print_scene, rising, OneDisc())


@pytest.mark.parametrize(
    ("difference", "muted", "said"),
    [
        (3e-13, ["N1"], "The whole model makes the same motion, with N1 = 0 to switch off what is left out: states"),
        (3e-13, [], "The whole model makes the same motion: states differ by 3.0e-13 of their size."),
        (None, [], "Contacts that are left out cannot be switched off in the whole model: its runs are another motion"),
    ],
)
def test_what_is_left_out_is_the_same_motion_or_said_to_be_another(
    difference: float | None, muted: list[str], said: str
) -> None:
    seconds = {"scene": 0.5, "model": 2.0}
    content = {
        "left_out": [{"kind": "contact", "name": "disc1", "why": "not among the contacts in use"}],
        "sizes": {"scene": {"contacts": 1, "bytes": 40e3}, "model": {"contacts": 2, "bytes": 100e3}},
        **dict.fromkeys(("build_seconds", "start_seconds", "run_seconds"), seconds),
        "difference": difference,
        "muted": muted,
    }
    told = printed(print_explained, content)
    assert told.count("motion") == 1 and said in told
    assert "contact disc1 not among the contacts in use" in told
    assert "FMU file 40 kB 100 kB 60 kB" in told and "time per run 500 ms 2e+03 ms 4.00 times faster" in told
