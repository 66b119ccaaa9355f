"""From a scene or a model to the one problem that every method gets."""

import dataclasses
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.trust import is_place
from fmu_models.lowering.fold import fold
from fmu_models.oscillators import MODELS
from fmu_models.scene.compute import arguments
from fmu_models.scene.kinds.kind import period
from fmu_models.scene.read import SUFFIX, files, read_scene
from fmu_models.scene.reduce import built_scene, reduced
from fmu_models.scene.scene import Drive, Scene
from fmu_models.simulation.signal import Signal
from fmu_models.validation.methods.result import MethodProblem

STOP_TIME = 20.0  # s, of a model without a scene


def problem(name: str, until: float | None = None) -> MethodProblem:
    """The problem of a scene (a TOML file, or the name of one that comes along) or of a model with its defaults. until:
    s, end of the run; that of the scene, or 20 s, if None. StickslipError: there is no such scene or model, or the time
    is not positive."""
    if until is not None and not 0.0 < until < float("inf"):
        raise StickslipError(f"The run must end after it starts, at a finite time; found {until:g} s.")
    return of_scene(_scene(name), until)


def _scene(name: str) -> Scene:
    scenes = [file.stem for file in files()]
    if name.endswith(SUFFIX) or name in scenes:
        return read_scene(name)
    if not is_place(name) and name not in MODELS.names():
        raise StickslipError(f"There is no scene or model '{name}'.{nearest(name, [*scenes, *MODELS.names()])}")
    return of_model(name)


def of_model(name: str) -> Scene:
    """A scene of a model with all its defaults held."""
    model = MODELS.load(name)
    defaults = {q.name: q.value for q in (*model.parameters, *model.inputs)}
    return Scene(
        name=model.name, title=model.title, source=model.source, model=name, contacts=None, laws={}, fixed=defaults,
        free={}, drives={}, start={}, outputs=(), stop_time=STOP_TIME,
    )  # fmt: skip


def of_scene(scene: Scene, until: float | None = None) -> MethodProblem:
    """The first of the runs that a scene asks for; one of an orbit is made over ten periods."""
    scene = _first(scene)
    stop = until or _end(scene)
    run = arguments(scene, stop)
    system = reduced(scene)
    steady = not any(isinstance(value, Signal) for value in run["inputs"].values())
    if steady:
        fixed = {**run["parameters"], **run["inputs"]}
        fixed |= {u.name: u.value for u in system.inputs if u.name not in fixed}
        system = fold(system, fixed=fixed, values={}, start=scene.start, outputs=())
    start = np.array([float(scene.start.get(s.name, s.start)) for s in system.states])
    nominal = np.array([float(s.nominal) for s in system.states])
    settings: dict[str, Any] = {key: run[key] for key in ("parameters", "start", "inputs")}
    return MethodProblem(
        name=scene.name, title=scene.title, system=system, start=start, nominal=nominal, stop_time=stop,
        fmu=built_scene(scene), arguments=settings, steady=steady,
    )  # fmt: skip


def _first(scene: Scene) -> Scene:
    """The scene with what it sweeps held at its first value."""
    compute = scene.compute
    if compute.over is None:
        return scene
    value = compute.values[0]
    single = dataclasses.replace(compute, over=None, values=(), follow=False)
    if compute.over in scene.drives:
        drives = {**scene.drives, compute.over: Drive(times=(0.0,), values=(value,))}
        return dataclasses.replace(scene, drives=drives, compute=single)
    return dataclasses.replace(scene, free={**scene.free, compute.over: value}, compute=single)


def _end(scene: Scene) -> float:
    if scene.compute.kind == "orbit" and not scene.compute.autonomous:
        return 10.0 * period(scene, {})
    return scene.stop_time
