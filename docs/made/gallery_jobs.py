"""What the gallery computes, each in a child process: the code that a page shows is the code that runs."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from PIL import Image

from fmu_models import Scene, explore, last_cycle, load, oscillators, simulate
from fmu_models.explorer.subject import subject_of
from fmu_models.oscillators import MODELS
from fmu_models.scene.compute import Comparison
from fmu_models.scene.kinds.kind import Row
from identification import Calibration
from made.literature import LiteratureJob

TEMPLATES = Path(__file__).parent / "templates"
RUN = 10.0  # s, of the portrait of a model


def template(name: str) -> jinja2.Template:
    """A template of the gallery."""
    loader = jinja2.FileSystemLoader(TEMPLATES)
    return jinja2.Environment(
        loader=loader, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined, autoescape=False
    ).get_template(name)


def place(one: Row | Comparison) -> str:
    """Where a value is: that of a panel, and of what is varied."""
    return ", ".join(f"{value:g}" for value in (one.panel, one.at) if value is not None)


@dataclass(frozen=True)
class SceneResult:
    """What a scene gave.

    Attributes:
        code: what ran.
        over: what is varied; None if nothing is.
        values: of what was found, by name, for each value of what is varied, in each panel.
        comparisons: with what is known of it.
        state: values by name with which the live page shows its motion, for as long as that page chooses.
        notes: what of the scene the live page leaves out.
    """

    scene: Scene
    code: str
    values: tuple[tuple[str, dict[str, float]], ...]
    comparisons: tuple[Comparison, ...]
    state: dict[str, float]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class ModelResult:
    """What a model gave.

    Attributes:
        about: how its file introduces it: equations, meaning, sources.
        code: what ran.
        quantities: name, value, unit and meaning of its parameters and inputs.
    """

    name: str
    title: str
    source: str
    about: str
    code: str
    quantities: tuple[tuple[str, str, str, str], ...]


@dataclass(frozen=True)
class LiveResult:
    """A live page, by the model and version that it names itself."""

    path: Path
    model: str
    version: str


@dataclass(frozen=True, eq=False)
class CalibrationCase:
    """A log with a known truth, and where the search begins. until: s; noise: sd of x."""

    name: str
    model: str
    until: float
    samples: int
    noise: float
    truth: dict[str, float]
    first: dict[str, float]
    seed: int = 1


CALIBRATIONS = (
    CalibrationCase(
        *("calibrated_support", "discontinuous_support", 60.0, 601, 0.01),
        {"ks": 10.0, "cs": 0.3, "g": 4.0, "k": 1.0, "c": 0.05, "f0": 0.5},
        {"ks": 15.0, "cs": 0.2, "g": 3.0, "k": 1.4, "c": 0.07, "f0": 0.35},
    ),
    CalibrationCase(
        *("calibrated_belt", "forced_stick_slip", 60.0, 601, 0.005),
        {"a0": 1.5, "a1": 1.5, "a3": 0.45, "k": 1.0, "f0": 0.1},
        {"a0": 2.2, "a1": 1.0, "a3": 0.65, "k": 0.7, "f0": 0.15},
    ),
    CalibrationCase(
        *("calibrated_pair", "impact_pair", 40.0, 801, 0.01),
        {"D": 6.0, "A": 1.0, "e": 0.6, "phi0": 0.0},
        {"D": 8.0, "A": 1.4, "e": 0.4, "phi0": 0.25},
    ),
    CalibrationCase(
        *("calibrated_hinge", "hinge_clearance", 60.0, 1201, 0.002),
        {"zeta": 0.2, "delta": 0.01, "k0": 300.0, "ce": 0.9, "f": 0.429},
        {"zeta": 0.3, "delta": 0.014, "k0": 200.0, "ce": 0.6, "f": 0.6},
    ),
    CalibrationCase(
        *("calibrated_ball", "bouncing_ball", 3.0, 3001, 5e-5),
        {"e": 0.7, "A": 6e-3, "phi0": 0.0},
        {"e": 0.5, "A": 8e-3, "phi0": 0.2},
    ),
)


@dataclass(frozen=True)
class CalibrationResult:
    """What a calibration gave.

    Attributes:
        title: of the model.
        code: what ran.
        values: per parameter its name, unit, value, deviation, and 95 % interval.
        sentences: what the log leaves open.
    """

    case: CalibrationCase
    title: str
    code: str
    values: tuple[tuple[str, str, float, float, tuple[float, float]], ...]
    sentences: tuple[str, ...]


@dataclass(frozen=True)
class CalibrationJob:
    """A calibration, and where its picture goes."""

    case: CalibrationCase
    picture: Path

    def __str__(self) -> str:
        return f"calibration {self.case.name}"

    def done(self) -> CalibrationResult:
        """Make its log, calibrate and draw it."""
        code = template("calibration.py.j2").render(case=self.case)
        found: Calibration = ran(code, self.picture)["found"]
        values = tuple(
            (one.name, one.unit, one.value, one.standard_deviation or 0.0, found.interval(one.name))
            for one in found.parameters
        )
        return CalibrationResult(self.case, found.title, code, values, (*found.directions, *found.warnings))


@dataclass(frozen=True)
class SceneJob:
    """A scene, and where its picture goes."""

    path: Path
    picture: Path

    def __str__(self) -> str:
        return f"scene {self.path.stem}"

    def done(self) -> SceneResult:
        """Compute, compare and draw it."""
        code = template("scene.py.j2").render(name=self.path.stem)
        made = ran(code.replace(f'"{self.path.stem}"', repr(str(self.path))), self.picture)
        scene: Scene = made["scene"]
        subject = subject_of(str(self.path))
        values = tuple((place(row), dict(row.values)) for row in made["rows"])
        return SceneResult(scene, code, values, made["comparisons"], dict(subject.values), subject.notes)


@dataclass(frozen=True)
class ModelJob:
    """A model, and where its portrait goes."""

    name: str
    picture: Path

    def __str__(self) -> str:
        return f"model {self.name}"

    def done(self) -> ModelResult:
        """Draw the cycle that its motion from the default start ends in, or else all of that motion."""
        declared = MODELS.load(self.name)
        across, up = _plane(self.name)
        cycle = last_cycle(load(self.name), RUN) is not None
        code = template("oscillator.py.j2").render(name=self.name, until=RUN, across=across, up=up, cycle=cycle)
        ran(code, self.picture)
        quantities = tuple((p.name, f"{p.value:g}", p.unit, p.description) for p in declared.parameters) + tuple(
            (u.name, f"{u.value:g}", u.unit, u.description) for u in declared.inputs
        )
        about = import_module(f"{oscillators.__name__}.{self.name}").__doc__ or ""
        return ModelResult(self.name, declared.title, declared.source, about, code, quantities)


@dataclass(frozen=True)
class LiveJob:
    """A live page of a model with the contacts in use; of a scene where that has other laws."""

    subject: str
    contacts: tuple[str, ...] | None
    path: Path

    def __str__(self) -> str:
        return f"live page {self.path.stem}"

    def done(self) -> LiveResult:
        """Write it."""
        page = explore(self.subject, contacts=self.contacts)
        page.write(self.path, overwrite=True)
        return LiveResult(self.path, page.name, page.version)


Job = SceneJob | ModelJob | LiveJob | CalibrationJob | LiteratureJob


def done(job: Job) -> Any:
    """Do a job."""
    return job.done()


def ran(code: str, picture: Path) -> dict[str, Any]:
    """Run the code of a page, with the name of its picture replaced by where it goes; its variables."""
    made: dict[str, Any] = {}
    exec(compile(code.replace(f'"{picture.name}"', repr(str(picture))), picture.stem, "exec"), made)
    with Image.open(picture) as drawn:  # 256 colours look the same, in a third of the bytes
        reduced = drawn.convert("RGB").quantize(256, dither=Image.Dither.NONE)
    reduced.save(picture, optimize=True)
    return made


def _plane(model: str) -> tuple[str, str]:
    """The first plane of the live page in which the motion stays: its coordinate does not go away by its own width."""
    planes = explore(model).planes
    run = simulate(load(model), RUN)
    for across, up in planes:
        first, last = np.array_split(run[across], 2)
        if abs(last.mean() - first.mean()) < 0.5 * np.ptp(last):
            return across, up
    return planes[0]
