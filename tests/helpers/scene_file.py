"""A scene as a file, for tests."""

from __future__ import annotations

from pathlib import Path

from fmu_models.scene.read import read_scene
from fmu_models.scene.scene import Scene

CLASS_A = """title = "one disc"
model = "disc_rig"
contacts = ["disc0"]
outputs = ["F0"]
stop_time = "5 s"

[parameters]
N0 = "8 N"

[drives]
w0 = "0.83 rad/s"
"""


def scene_of(folder: Path, text: str, name: str = "given") -> Scene:
    path = folder / f"{name}.toml"
    path.write_text(text)
    return read_scene(path)
