"""The page of the papers' figures: each with the command that draws it, its picture, and its values that are met."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from made.gallery_jobs import SceneResult

DRAWING = "a drawing"
MAPS_PAGE = "[return maps](../return_maps.md)"
FIGURE_HEADS = ("figure", "command", "picture", "values met")
FIGURES = """---
hide-toc: true
---

# Figures of the papers

The page is not made unless every value of every row is met. Values come from closed forms, other programs or print:
each scene says which. `--figure FILE` draws one, as PNG, SVG or PDF.
"""


@dataclass(frozen=True)
class Paper:
    """A source of models.

    Attributes:
        models: their names.
        figures: how many it has.
        elsewhere: by number, what a figure without a scene is, or where it is.
    """

    title: str
    models: tuple[str, ...]
    figures: int
    elsewhere: Mapping[int, str] = field(default_factory=dict)


PAPERS = (
    Paper(
        "Rotational oscillator against driven discs (Casini, Giannini, Vestroni, 2006)",
        ("disc_rig", "disc_rig_sequential", "disc_rig_overlapping", "block_on_belt", "drive_motor"),
        13,
        {1: DRAWING, 6: f"{DRAWING} of the rig", 7: "measured friction; its numbers are in Table 1"},
    ),
    Paper(
        "Oscillator with a discontinuous support, by the switch model of Leine and van Campen",
        ("discontinuous_support",),
        11,
        {1: DRAWING, 2: DRAWING},
    ),
    Paper(
        "Hinge with clearance (Ding et al.)",
        ("hinge_clearance", "hinge_clearance_clamped", "hinge_clearance_dimensional"),
        18,
        {1: DRAWING, 2: DRAWING, 3: f"{DRAWING} of Wolf's method"},
    ),
    Paper(
        "Bifurcations in non-smooth systems (Leine and van Campen, 2006)",
        (
            "planar_hopf",
            "planar_multiple_crossing",
            "planar_multiple_crossing_smooth",
            "forced_stick_slip",
            "woodpecker",
        ),
        19,
        {7: DRAWING, 11: DRAWING, 14: DRAWING, 15: MAPS_PAGE, 18: MAPS_PAGE, 19: MAPS_PAGE},
    ),
    Paper(
        "Vibro-impact dynamics (Luo and Guo), its systems by what others publish of them",
        ("bouncing_ball", "impact_pair", "impact_damper", "fermi_accelerator", "two_domain_oscillator"),
        0,
    ),
)


def figure_of(source: str) -> str:
    """What a source says of figures and tables, as "figures 8 to 10"; empty if nothing."""
    found = re.search(r"(figures? \d[^;]*|Table \d+(?!.*figure)[^;]*)", source)
    return found[1] if found else ""


def figures_of(source: str) -> tuple[int, ...]:
    """Numbers of the figures that a source names, ascending."""
    found = re.search(r"figures? (\d+(?:(?:, | to | and )\d+)*)", source)
    numbers: set[int] = set()
    for part in re.split(", | and ", found[1]) if found else ():
        first, _, last = part.partition(" to ")
        numbers |= {*range(int(first), int(last or first) + 1)}
    return tuple(sorted(numbers))


def rows_of(paper: Paper, results: Iterable[SceneResult], pictures: str) -> list[tuple[str, ...]]:
    """A row under ``FIGURE_HEADS`` for each scene of each figure; ``pictures``: their folder, beside the page."""
    of_paper = [one for one in results if one.scene.model in paper.models]
    lines: list[tuple[str, ...]] = []
    for number in range(1, paper.figures + 1):
        cells = [(paper.elsewhere[number], "", "")] if number in paper.elsewhere else []
        cells += [
            (
                f"`stickslip scene {one.scene.name}`<br>{one.scene.title}",
                f"[![]({pictures}/{one.scene.name}.png)](scenes/{one.scene.name}.md)",
                str(len(one.comparisons)),
            )
            for one in of_paper
            if number in figures_of(one.scene.source)
        ]
        lines += [(str(number) if i == 0 else "", *cell) for i, cell in enumerate(cells)]
    return lines
