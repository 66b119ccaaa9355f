"""Sphinx extension that makes the gallery: a page per scene and per oscillator, computed whenever the manual is built.

    scene       its picture and results by the code that its page shows, compared with its known values
    oscillator  the portrait of its motion from the default start, and the known values of all its scenes
    calibration a log with a known truth, and what is found of it, by the code that its page shows
    live page   `explore` of each model with the contacts in use; pages of one model share it and tell it their values

A known value that is not met, or a job that fails, stops the build.
"""

from __future__ import annotations

import html
import json
import os
import shutil
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.display import status_iterator

from fmu_models import read_scene
from fmu_models.base.digits import like_sd, value_with_sd
from fmu_models.base.errors import StickslipError
from fmu_models.base.processes import in_processes
from fmu_models.base.shipped import LITERATURE
from fmu_models.base.shipped import files as shipped_files
from fmu_models.oscillators import MODELS
from fmu_models.scene.compute import Comparison
from fmu_models.scene.read import files
from fmu_models.scene.scene import Scene
from made.figures import FIGURE_HEADS, FIGURES, PAPERS, figure_of, figures_of, rows_of
from made.gallery_jobs import (
    CALIBRATIONS,
    RUN,
    CalibrationCase,
    CalibrationJob,
    CalibrationResult,
    Job,
    LiveJob,
    LiveResult,
    ModelJob,
    ModelResult,
    SceneJob,
    SceneResult,
    done,
    place,
    template,
)
from made.literature import HEADS, INTRODUCTION, KnownValues, LiteratureJob, rows

ALLOWED = 4  # deviations: so far off the truth a calibration may be
PICTURES, LIVE = "pictures", "live"  # folders beside the pages


def setup(app: Sphinx) -> dict[str, Any]:
    """Make the pages before Sphinx looks for pages."""
    app.connect("builder-inited", _make_all)
    app.add_css_file("gallery.css")
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _make_all(app: Sphinx) -> None:
    pages = Path(app.srcdir) / "gallery"
    shutil.rmtree(pages, ignore_errors=True)

    def told(outcomes: Iterable[Any], jobs: Sequence[Job]) -> Iterable[Any]:
        return status_iterator(
            outcomes, "making the gallery... ", "brown", len(jobs), stringify_func=lambda one: str(jobs[one[0]])
        )

    try:
        make(
            files(),
            MODELS.members(),
            pages,
            Path(app.outdir) / "gallery" / LIVE,
            CALIBRATIONS,
            told,
            shipped_files(LITERATURE),
        )
    except StickslipError as error:
        raise ExtensionError(str(error)) from error


def make(
    scenes: Sequence[Path],
    models: Sequence[str],
    pages: Path,
    live: Path,
    calibrations: Sequence[CalibrationCase] = (),
    told: Callable[[Iterable[Any], Sequence[Job]], Iterable[Any]] = lambda outcomes, _: outcomes,
    literature: Sequence[Path] = (),
) -> None:
    """Write the pages of scenes, models and calibrations to a folder, and their live pages into the finished manual.

    Args:
        told: passes on the outcomes of jobs, and may tell of them.
        literature: scenes that share one page, which shows their known values alone.

    Raises:
        StickslipError: what fails, and every known value that is not met.
    """
    pictures = pages / PICTURES
    for folder in (pages / "scenes", pages / "oscillators", pages / "calibrations", pictures, live):
        folder.mkdir(parents=True, exist_ok=True)
    lives = {path.stem: _live_of(read_scene(path), live) for path in scenes}
    lives |= {name: LiveJob(name, None, live / f"{name}.html") for name in models}
    jobs: list[Job] = [
        *dict.fromkeys(lives.values()),
        *(SceneJob(path, pictures / f"{path.stem}.png") for path in scenes),
        *(ModelJob(name, pictures / f"{name}.png") for name in models),
        *(CalibrationJob(case, pictures / f"{case.name}.png") for case in calibrations),
        *map(LiteratureJob, literature),
    ]
    outcomes = dict(told(in_processes(done, [(job,) for job in jobs], processes=_cores(), threads=1), jobs))
    results = [outcomes[i] for i in range(len(jobs))]
    faults = [f"{job}: {one}" for job, one in zip(jobs, results, strict=True) if isinstance(one, Exception)]
    faults += [
        f"scene {one.scene.name}: {fault}"
        for one in results
        if isinstance(one, SceneResult | KnownValues)
        for fault in missed(one)
    ]
    of_calibrations = [one for one in results if isinstance(one, CalibrationResult)]
    faults += [
        f"{one.case.name}: {name} is {found:.6g} +- {sd:.2g}, the truth is {truth:g}"
        for one in of_calibrations
        for name, _, found, sd, _ in one.values
        if abs(found - (truth := one.case.truth[name])) > ALLOWED * sd
    ]
    if faults:
        raise StickslipError("The gallery does not hold:\n" + "\n".join(faults))
    found = dict(zip(jobs, results, strict=True))
    of_scenes = [one for one in results if isinstance(one, SceneResult)]
    of_models = [one for one in results if isinstance(one, ModelResult)]
    for one in of_scenes:
        text = scene_page(one, found[lives[one.scene.name]])
        (pages / "scenes" / f"{one.scene.name}.md").write_text(text, "utf-8")
    for one in of_models:
        text = model_page(one, found[lives[one.name]], [s for s in of_scenes if s.scene.model == one.name])
        (pages / "oscillators" / f"{one.name}.md").write_text(text, "utf-8")
    for one in of_calibrations:
        (pages / "calibrations" / f"{one.case.name}.md").write_text(calibration_page(one), "utf-8")
    if known := [one for one in results if isinstance(one, KnownValues)]:
        lines = rows(known)
        text = INTRODUCTION.format(systems=len(known), values=len(lines)) + "\n" + table(HEADS, lines) + "\n"
        (pages / "literature.md").write_text(text, "utf-8")
    tables = (
        (paper.title, table(FIGURE_HEADS, lines)) for paper in PAPERS if (lines := rows_of(paper, of_scenes, PICTURES))
    )
    text = "\n\n".join([FIGURES, *(f"## {title}\n\n{text}" for title, text in tables)])
    (pages / "figures.md").write_text(text + "\n", "utf-8")
    (pages / "index.md").write_text(index_page(of_scenes, of_models, of_calibrations, bool(literature)), "utf-8")


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _live_of(scene: Scene, folder: Path) -> LiveJob:
    """The live page of a scene: that of its model with the contacts in use, or its own where it has other laws."""
    if scene.laws:
        return LiveJob(scene.path, None, folder / f"{scene.name}.html")
    name = scene.model if scene.contacts is None else "-".join([scene.model, *(scene.contacts or ("free",))])
    return LiveJob(scene.model, scene.contacts, folder / f"{name}.html")


def missed(one: SceneResult | KnownValues) -> list[str]:
    """The known values that a scene does not meet, in words."""
    found = []
    for c in one.comparisons:
        if not c.passed:
            at = "" if c.at is None else f" at {c.at:g}"
            found.append(
                f"{c.name}{at} is {c.found:.13g}, known is {c.known:.13g}, allowed an error of {c.tolerance:g}"
            )
    return found


def scene_page(one: SceneResult, live: LiveResult) -> str:
    """The page of a scene, as Markdown."""
    over = varied(one.scene)
    toml = Path(one.scene.path).read_text("utf-8").strip()
    values = [(name, at, f"{value:.10g}") for at, found in one.values for name, value in found.items()]
    return template("scene.md.j2").render(
        scene=one.scene,
        seen=_head(toml),
        frame=frame(live, one.state),
        notes="".join(f" In it {note}." for note in one.notes),
        comparisons=comparison_table(one.comparisons, over) if one.comparisons else "",
        values=table(("value", over, "found"), values),
        code=one.code,
        toml=toml,
    )


def model_page(one: ModelResult, live: LiveResult, scenes: Sequence[SceneResult]) -> str:
    """The page of an oscillator, as Markdown."""
    rows = [
        (f"[{s.scene.title}](../scenes/{s.scene.name}.md)", *cells)
        for s in scenes
        for cells in (_cells(c, varied(s.scene)) for c in s.comparisons)
    ]
    quantities = [(f"`{name}`", value, unit, meaning) for name, value, unit, meaning in one.quantities]
    return template("oscillator.md.j2").render(
        one=one,
        until=RUN,
        frame=frame(live, {}),
        comparisons=table(("scene", *COLUMNS), rows) if rows else "",
        quantities=table(("name", "value", "unit", "meaning"), quantities),
    )


def calibration_page(one: CalibrationResult) -> str:
    """The page of a calibration, as Markdown."""
    case, rows = one.case, []
    for name, unit, value, sd, ends in one.values:
        interval = " to ".join(like_sd(end, sd) for end in ends)
        rows.append(
            (f"`{name}`", f"{case.first[name]:g}", f"{case.truth[name]:g}", value_with_sd(value, sd, unit), interval)
        )
    values = table(("parameter", "first", "truth", "found", "95 % interval"), rows)
    return template("calibration.md.j2").render(
        case=case, title=one.title, code=one.code, values=values, sentences=one.sentences, allowed=ALLOWED
    )


def index_page(
    scenes: Sequence[SceneResult],
    models: Sequence[ModelResult],
    calibrations: Sequence[CalibrationResult],
    literature: bool = False,
) -> str:
    """The page that shows them all, as Markdown."""
    papers = [
        {
            "title": paper.title,
            "scenes": thumbnails(
                (f"scenes/{s.scene.name}", s.scene.title, figure_of(s.scene.source))
                for s in sorted(scenes, key=lambda s: ([*figures_of(s.scene.source), 99][0], s.scene.name))
                if s.scene.model in paper.models
            ),
        }
        for paper in PAPERS
    ]
    of_models = (
        (f"oscillators/{name}", m.title, "") for p in PAPERS for name in p.models for m in models if m.name == name
    )
    return template("index.md.j2").render(
        papers=papers,
        oscillators=thumbnails(of_models),
        calibrations=thumbnails((f"calibrations/{one.case.name}", one.title, "") for one in calibrations),
        known=sum(len(s.comparisons) for s in scenes),
        literature=literature,
    )


def thumbnails(entries: Iterable[tuple[str, str, str]]) -> str:
    """Pictures that lead to their pages: page, title, what its source calls it."""
    shown = [
        f"[![]({PICTURES}/{Path(page).name}.png) {title} *{called}*]({page}.md)" for page, title, called in entries
    ]
    if not shown:
        return ""
    return "\n\n".join(["::::{container} thumbnails", *(one.replace(" **]", "]") for one in shown), "::::"])


def frame(live: LiveResult, values: dict[str, float]) -> str:
    """A live page in a frame, told the values of a scene by its address."""
    state = {"model": live.model, "version": live.version, "set": values}
    address = f"../{LIVE}/{live.path.name}" + (f"#{quote(json.dumps(state))}" if values else "")
    return (
        "```{raw} html\n"
        f'<iframe class="live" src="{address}" title="{html.escape(live.model)}, live" loading="lazy" '
        'sandbox="allow-scripts allow-downloads"></iframe>\n'
        f'<p><a href="{address}">The live page alone</a></p>\n'
        "```"
    )


COLUMNS = ("value", "at", "known", "found", "error", "allowed")


def comparison_table(comparisons: Sequence[Comparison], over: str) -> str:
    """Known values beside those found."""
    return table(COLUMNS, [_cells(c, over) for c in comparisons])


def varied(scene: Scene) -> str:
    """Names of what panels and values are of."""
    return ", ".join([*scene.compute.panels, *([scene.compute.over] if scene.compute.over else [])])


def _cells(c: Comparison, over: str) -> tuple[str, ...]:
    at = f"{over} = {place(c)}" if place(c) else ""
    at += "" if c.panel is None else f" in panel {c.panel:g}"
    return (f"`{c.name}`", at, f"{c.known:.13g}", f"{c.found:.13g}", f"{c.error:.1e}", f"{c.tolerance:.0e}")


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown, whose last columns are not broken."""
    lines = [heads, ["---"] * len(heads), *rows]
    made = (f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |" for line in lines)
    return "\n".join(["::::{container} whole-numbers", "", *made, "", "::::"])


def _head(toml: str) -> str:
    """The remark at the head of a scene: what is to be seen."""
    lines = []
    for line in toml.splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.lstrip("# "))
    return " ".join(lines)
