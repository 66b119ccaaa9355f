"""The page of the systems of the literature: each scene's known values beside those found when the manual is built."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from fmu_models import Fmu, Scene, read_scene
from fmu_models.scene.compute import Comparison, compare, compute
from fmu_models.scene.reduce import built_scene

HEADS = ("system", "scene", "source", "value", "known", "found", "error", "allowed", "who says so")
INTRODUCTION = """---
hide-toc: true
---

# Systems of the literature

{systems} published systems, smooth, discrete and hybrid, each declared in at most 20 lines of Python in
`data/systems_of_the_literature`, with a scene. This page is not made unless each of their {values} known values is
found. Values that are called computed come from other programs of the same equations, in
`tests/physics/test_systems_of_the_literature.py`.

```sh
stickslip scene lorenz --figure lorenz.png
stickslip data copy systems_of_the_literature/lorenz.py
stickslip simulate data/systems_of_the_literature/lorenz.py --until 40 --figure run.png
```
"""


@dataclass(frozen=True)
class KnownValues:
    """What is known of a scene, and what was found."""

    scene: Scene
    comparisons: tuple[Comparison, ...]


@dataclass(frozen=True)
class LiteratureJob:
    """A scene whose values are compared; no picture is drawn of it."""

    path: Path

    def __str__(self) -> str:
        return f"scene {self.path.stem}"

    def done(self) -> KnownValues:
        """Compute and compare it."""
        scene = read_scene(self.path)
        return KnownValues(scene, compare(scene, compute(scene, Fmu.open(built_scene(scene)))))


def rows(results: Iterable[KnownValues]) -> list[tuple[str, ...]]:
    """A row per known value under ``HEADS``; what a scene says of itself stands in its first one."""
    lines: list[tuple[str, ...]] = []
    for one in results:
        system = (one.scene.name.replace("_", " "), one.scene.title, one.scene.source)
        for c in one.comparisons:
            at = "" if c.at is None or len({c.at for c in one.comparisons}) == 1 else f" at {c.at:g}"
            numbers = (f"{c.known:.13g}", f"{c.found:.13g}", f"{c.error:.0e}", f"{c.tolerance:.0e}")
            lines.append((*system, f"`{c.name}`{at}", *numbers, c.source))
            system = ("", "", "")
    return lines
