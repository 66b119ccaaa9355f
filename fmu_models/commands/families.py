"""What commands about families of motions take and give: a system at its section, ranges, files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.analyses.declaration import EITHER, SECTION, Range
from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.base.figures import check_files
from fmu_models.base.files import write_whole
from fmu_models.base.shipped import is_scene
from fmu_models.commands.arguments import NAMED, scene_of

if TYPE_CHECKING:
    import numpy as np

    from fmu_models.base.shown import Pictured
    from fmu_models.families.execution import Execution
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.language.maps import Map
    from fmu_models.report.interactive import PickedMotion
    from fmu_models.scene.scene import Compute, Scene
    from fmu_models.sections.system import SectionSystem

Ranges = Annotated[
    list[str] | None,
    typer.Option("--over", metavar="NAME=FROM:TO:COUNT", help="Values, evenly spaced (default: those of a scene)."),
]

Bounds = Annotated[
    list[str] | None,
    typer.Option("--over", metavar="NAME=FROM:TO", help="Parameter and its range (default: those of a scene)."),
]

SUFFIXES, STORE = (".csv", ".nc"), ".zarr"


@dataclass(frozen=True)
class SectionOptions:
    """A model and the section that its motions are looked at: what every command about families takes."""

    model: Annotated[
        str,
        typer.Argument(
            metavar="MODEL", help=f"A map, an .fmu file, of others too, a scene (.toml), or a model: {NAMED}."
        ),
    ]
    settings: console.Settings = None
    start: Annotated[list[str] | None, typer.Option(metavar="NAME=VALUE", help="Start value of a state.")] = None
    begin: Annotated[
        Path | None, typer.Option("--from", metavar="ORBIT.json", help="Start values by name, instead of --start.")
    ] = None
    contacts: console.Contacts = None
    forcing: Annotated[
        str | None, typer.Option(metavar="NAME", help="The parameter that is the frequency of the forcing: a strobe.")
    ] = None
    period: Annotated[float | None, typer.Option(help="Instead: period of the forcing, s.")] = None
    every: Annotated[int, typer.Option(help="Periods of the forcing in one step of the strobe.", min=1)] = 1
    autonomous: Annotated[
        bool, typer.Option("--autonomous", help="Nothing forces the motion; look at it every --period.")
    ] = False
    level: Annotated[
        str | None, typer.Option(metavar="STATE=VALUE", help="The section is where a state crosses a level, upward.")
    ] = None
    down: Annotated[bool, typer.Option("--down", help="With --level: downward.")] = False
    impacts: Annotated[str | None, typer.Option(metavar="CONTACT", help="The section is where a contact begins.")] = (
        None
    )
    returns: Annotated[
        str | None,
        typer.Option(metavar="STATE", help="With --level: a return map of this state alone, others as at the start."),
    ] = None
    accept: Annotated[
        list[str] | None,
        typer.Option(metavar="CONTACT=STATE", help="With --returns: its state at a crossing that counts, 0 for stick."),
    ] = None
    cap: Annotated[float | None, typer.Option(help="With --returns: after which time there is no return, s.")] = None
    stepper: Annotated[
        str, typer.Option(help="Of strobes: auto, the exact flow where there is one; or taylor, the series alone.")
    ] = "auto"

    def system(self) -> SectionSystem:
        """The system that the options describe. StickslipError: options that contradict one another, or as the section
        does."""
        from fmu_models.fmu.load import load
        from fmu_models.scene.kinds.kind import section_at
        from fmu_models.scene.scene import Compute
        from fmu_models.sections.iteration import Iteration

        values = console.assignments(self.settings, "parameter")
        if self.level and self.impacts and not self._is_map:
            raise StickslipError("The section is a level of a state, or where a contact begins: name one of them.")
        if self._is_map and (self.forcing or self.period or self.contacts or self._named):
            raise StickslipError(f"'{self.model}' is a map: every step of it is the section. Leave the section out.")
        if self._scene is not None:
            return self._of_scene(self._scene, values)
        if self._map is not None:
            return Iteration.of(self._map, values)
        fmu, computation = load(self.model, contacts=console.chosen(self.contacts)), Compute(**self._named)
        common: dict[str, Any] = {"forcing": self.forcing, "period": self.period, "parameters": values}
        return section_at(fmu, self._checked(computation), self.starts(), **common, stepper=self.stepper)

    @property
    def _named(self) -> dict[str, Any]:
        """What is given of a section, by the keys of a scene."""
        level = console.assignments([self.level], "level") if self.level else {}
        given = {"level": level, "down": self.down, "impacts": self.impacts} if level or self.impacts else {}
        accept = console.assignments(self.accept, "state of a contact")
        others = {"returns": self.returns, "accept": accept, "cap": self.cap, "autonomous": self.autonomous}
        return given | {name: value for name, value in others.items() if value}

    def _checked(self, computation: Compute) -> Compute:
        """With the periods of a step. StickslipError: a return map without a level, or its options without it."""
        alone = (self.accept or self.cap) and not computation.returns
        if alone or (computation.returns and (not computation.level or self.forcing or self.period)):
            raise StickslipError(
                "A return map needs the state that it maps and the level where the motion returns, and no period: "
                "--level STATE=VALUE --returns STATE, then also --accept and --cap."
            )
        return replace(computation, periods=self.every) if self.every > 1 else computation

    @cached_property
    def _scene(self) -> Scene | None:
        return scene_of(self.model, self.contacts) if is_scene(self.model) else None

    @cached_property
    def _map(self) -> Map | None:
        from fmu_models.fmu.load import named_map

        return named_map(self.model) if self._scene is None else None

    @property
    def _is_map(self) -> bool:
        return self._map is not None if self._scene is None else self._scene.of_map

    def _of_scene(self, scene: Scene, values: Mapping[str, float]) -> SectionSystem:
        """The section of a scene; what is given here goes before what it says."""
        from fmu_models.scene.kinds.kind import section_of
        from fmu_models.sections.iteration import Iteration
        from fmu_models.sections.return_map import ReturnMap

        computation = self._named
        if self.forcing in scene.fixed and self.forcing != scene.compute.forcing:
            raise StickslipError(
                f"'{self.forcing}' is a constant of scene '{scene.name}'. Move it to [free] there for a strobe of it."
            )
        if self.forcing or self.period:
            computation |= {"forcing": self.forcing, "period": self.period}
        if self.forcing and self.period:
            raise StickslipError(f"The period follows from '{self.forcing}'; leave out --period, or --forcing.")
        changed = replace(scene, compute=self._checked(replace(scene.compute, **computation)))
        fmu, run = _built_with(scene, values)
        section = section_of(changed, fmu, run["parameters"], run["inputs"])
        return section if isinstance(section, Iteration | ReturnMap) else section.stepped_by(self.stepper)

    def oscillator(self) -> tuple[Fmu, dict[str, float]]:
        """The model itself, without a section, and values of its parameters and inputs. StickslipError: a map, a drive
        of a scene that moves, or as loading does."""
        from fmu_models.fmu.load import load
        from fmu_models.scene.kinds.kind import constants_of

        values = console.assignments(self.settings, "parameter")
        if self._is_map:
            raise StickslipError(
                f"'{self.model}' is a map: it has no rates. Its fixed points are followed by 'branch'."
            )
        if self._scene is not None:
            fmu, run = _built_with(self._scene, values)
            return fmu, constants_of(self._scene, run)
        return load(self.model, contacts=console.chosen(self.contacts)), values

    def starts(self) -> dict[str, float]:
        """Start values that are given, and what a scene says beside them."""
        values = console.assignments(self.start, "start value") | (_orbit(self.begin) if self.begin else {})
        return {**self._scene.start, **values} if self._scene is not None else values

    def subject(self, kind: str) -> tuple[SectionSystem | Fmu, dict[str, Any]]:
        """What an analysis is of, and the values of parameters that it takes beside it.

        Errors as for ``system`` or ``oscillator``.
        """
        named = self.forcing or self.period or self.level or self.impacts or self._is_map
        if kind == SECTION or (kind == EITHER and named):
            return self.system(), {}
        fmu, values = self.oscillator()
        if kind == EITHER and fmu.signals:
            return self.system(), {}
        return fmu, {"parameters": values}

    def motion(self) -> PickedMotion | None:
        """What a click in a page shows; None of a map, and, with a warning, of what no page can compute."""
        from fmu_models.explorer.page import explore
        from fmu_models.report.interactive import PickedMotion

        if self._is_map:
            return None
        try:
            page = explore(self.model, contacts=console.chosen(self.contacts))
        except StickslipError as error:
            console.warn(f"A click in the page shows no motion: {error}")
            return None
        values = {**console.assignments(self.settings, "parameter"), **self.starts()}
        return PickedMotion(page._repr_html_(), page.name, page.version, values)

    def axes(self, kind: str, over: Sequence[str] | None, count: int | None = None) -> dict[str, Any]:
        """Values along each axis; those of a scene of the same kind where none are given; errors as for ``ranges``."""
        import numpy as np

        computation = self._same(kind)
        if over or computation is None:
            return ranges(over or (), count)
        return {
            name: np.array(values)
            for name, values in (computation.axes or {str(computation.over): computation.values}).items()
        }

    def range(self, kind: str, over: Sequence[str] | None) -> dict[str, tuple[float, float]]:
        """Least and largest value of a parameter; those of a scene of the same kind where none are given.
        StickslipError: several ranges, or as ``one_range``."""
        if not over:
            return {name: (float(min(values)), float(max(values))) for name, values in self.axes(kind, ()).items()}
        if len(over) > 1:
            raise StickslipError(f"A branch is followed over one parameter, found {len(over)} ranges.")
        name, low, high = one_range(over[0])
        return {name: (low, high)}

    def options(self, kind: str, **options: int | str | None) -> dict[str, Any]:
        """Arguments of the analysis that are given, or that a scene of the same kind says."""
        computation = self._same(kind)
        settings = {} if computation is None else computation.settings
        return {**settings, **{name: value for name, value in options.items() if value is not None}}

    def _same(self, kind: str) -> Compute | None:
        """What a scene computes, if it is of this kind."""
        return self._scene.compute if self._scene is not None and self._scene.compute.kind == kind else None


@dataclass(frozen=True)
class Files:
    """Where what was found goes."""

    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Write the table as .csv, or the arrays as .nc.")
    ] = None
    figure: Annotated[Path | None, typer.Option("--figure", help="Draw it (png, svg, pdf).")] = None
    interactive: Annotated[
        Path | None,
        typer.Option(
            "--interactive", help="Write a page (html): zoom, values under the cursor, and on a click the motion there."
        ),
    ] = None
    overwrite: console.Overwrite = False
    json: console.Json = False

    def check(self) -> None:
        """Refuse before the work what could not be written after it."""
        self._check(SUFFIXES, self.output)

    def _check(self, suffixes: Sequence[str], written: Path | None) -> None:
        check_files(written, self.interactive, figures=[self.figure], overwrite=self.overwrite)
        if self.output is not None and self.output.suffix.lower() not in suffixes:
            raise StickslipError(
                f"'{self.output}' must end in one of {', '.join(suffixes)}, by which the format is chosen."
            )
        if self.interactive is not None:
            from fmu_models.report.interactive import check_page

            check_page(self.interactive)

    def tell(self, result: Pictured, content: dict[str, Any], section: SectionOptions | None = None) -> None:
        """Write what was found, and say it. section: whose motions a click in the page shows."""
        if self.output is not None and self.output.suffix.lower() != STORE:
            with write_whole(self.output, overwrite=self.overwrite) as temporary:
                if self.output.suffix.lower() == ".csv":
                    result.frame.to_csv(temporary, float_format="%.17g")
                else:
                    result.to_xarray().to_netcdf(temporary, engine="scipy")
        if self.figure is not None:
            result.figure(self.figure, overwrite=self.overwrite)
        if self.interactive is not None:
            from fmu_models.report.interactive import write_page

            motion = None if section is None else section.motion()
            write_page(result, self.interactive, overwrite=self.overwrite, motion=motion)
        content["how"] = getattr(result, "how", "")
        content["files"] = [str(path) for path in (self.output, self.figure, self.interactive) if path]

        def show(out: console.Console) -> None:
            for line in result.summary().split("\n"):
                below = len(line) - len(line.lstrip()) + 2
                out.print(console.hanging(line, out.width, below), markup=False, highlight=False)
            for row in content.get("failures", [])[:10]:
                out.print(f"failed: {row}", markup=False)
            console.print_files(content["files"], out)

        console.say(self.json, content, show)


@dataclass(frozen=True)
class FamilyRuns:
    """Who makes the runs."""

    workers: Annotated[int | None, typer.Option(help="Threads (default: as many as there are cores).", min=1)] = None
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Instead: a Dask cluster, tcp://host:8786.")
    ] = None


@dataclass(frozen=True)
class StoredFiles(Files):
    """The same of an analysis that makes many runs, whose chunks can be kept as they come."""

    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Write the table as .csv, the arrays as .nc, or all runs as they come into a .zarr store.",
        ),
    ] = None
    resume: Annotated[bool, typer.Option("--resume", help="Go on with an unfinished store: -o run.zarr.")] = False

    @property
    def store(self) -> Path | None:
        """The store, where one is asked for."""
        return self.output if self.output is not None and self.output.suffix.lower() == STORE else None

    def execution(self, runs: FamilyRuns) -> Execution:
        """Who makes the runs, and where they are kept."""
        from fmu_models.families.execution import Execution

        return Execution(runs.workers, runs.scheduler, self.store, self.resume, self.overwrite)

    def check(self) -> None:
        """As for ``Files``; a store refuses what is there already by itself."""
        self._check((*SUFFIXES, STORE), None if self.store else self.output)
        if self.resume and self.store is None:
            raise StickslipError("--resume goes on with a store, which keeps the runs: name it, -o run.zarr.")


def _built_with(scene: Scene, values: Mapping[str, float]) -> tuple[Fmu, dict[str, Any]]:
    """The FMU of a scene, and arguments of its run with other values of parameters and drives."""
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.scene.compute import arguments
    from fmu_models.scene.reduce import built_scene

    drives = {name: value for name, value in values.items() if name in scene.drives}
    free = {name: value for name, value in values.items() if name not in drives}
    return Fmu.open(built_scene(scene)), arguments(scene, parameters=free, inputs=drives)


def one_range(text: str) -> Range:
    """Name, least and largest value of NAME=FROM:TO. StickslipError: not of that form."""
    name, _, values = text.partition("=")
    try:
        low, high = (float(value) for value in values.split(":"))
    except ValueError:
        raise StickslipError(f"A range is given as NAME=FROM:TO, as omega=0.8:1.4; found '{text}'.") from None
    return name.strip(), low, high


def _orbit(path: Path) -> dict[str, float]:
    """Start values from a file."""
    import json

    try:
        read = json.loads(path.read_text("utf-8"))
        start: Any = read.get("start", read) if isinstance(read, dict) else None
        return {str(name): float(value) for name, value in start.items()}
    except (OSError, ValueError, AttributeError, TypeError) as error:
        raise StickslipError(
            f"'{path}' holds no start values: {error}. Write one JSON object with a number per state."
        ) from error


def ranges(texts: Sequence[str], count: int | None) -> dict[str, np.ndarray]:
    """Values by name from arguments NAME=FROM:TO:COUNT. StickslipError: none, another number of them than ``count``
    where there is one, or not of that form."""
    import numpy as np

    axes: dict[str, np.ndarray] = {}
    for text in texts:
        name, _, values = text.partition("=")
        fields = values.split(":")
        try:
            low, high, number = float(fields[0]), float(fields[1]), int(fields[2])
            axes[name.strip()] = np.linspace(low, high, number)
        except (IndexError, ValueError):
            raise StickslipError(
                f"A range is given as NAME=FROM:TO:COUNT, as omega=0.8:1:200; found '{text}'."
            ) from None
        if number < 1 or len(fields) != 3:
            raise StickslipError(f"A range has three parts, and one value at least; found '{text}'.")
    if len(axes) != (count or max(1, len(axes))):
        needed = "1 range is" if count == 1 else f"{count} ranges are" if count else "A range for each axis is"
        raise StickslipError(f"{needed} needed, found {len(axes)}: --over NAME=FROM:TO:COUNT")
    return axes
