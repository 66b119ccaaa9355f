"""What a scene says of itself, and of what its FMU does without."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path
from typing import Any

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


def test_what_is_left_out_is_named_and_sized() -> None:
    content = {
        "left_out": [{"kind": "contact", "name": "disc1", "why": "not among the contacts in use"}],
        "sizes": {"scene": {"contacts": 1, "bytes": 40e3}, "model": {"contacts": 2, "bytes": 100e3}},
    }
    told = printed(print_explained, content)
    assert "contact disc1 not among the contacts in use" in told
    assert "contacts 1 2 1" in told and "FMU file 40 kB 100 kB 60 kB" in told
