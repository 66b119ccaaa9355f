"""Times of the FMU of a scene against that of its whole model: runs in pairs, one of each in turn; building and
starting in processes of their own, as a user meets them, from the start of the interpreter to the first result."""

import os
import statistics
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fmu_models.base.cache import cache_folder
from fmu_models.base.processes import isolated
from fmu_models.base.temporary import temporary_folder
from fmu_models.codegen.package import variant
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.compute import arguments
from fmu_models.scene.left_out import whole_model
from fmu_models.scene.reduce import built_scene
from fmu_models.scene.scene import Scene
from fmu_models.simulation.run import simulate

PAIRS = 21
LONGEST = 5.0  # s, after which no further pair of runs is begun


@dataclass(frozen=True)
class TimedRuns:
    """Times of runs of the scene's FMU and of that of its model.

    Attributes:
        scene, model: s, median wall time of the engine per run.
        faster: median of the ratios of the pairs.
        difference: largest difference of a state, in fractions of its size; None if the runs are different motions,
            since contacts that are left out cannot be switched off in the model.
        muted: parameters by which they were switched off, with their values.
    """

    scene: float
    model: float
    faster: float
    difference: float | None
    muted: Mapping[str, float]


def time_runs(scene: Scene, pairs: int = PAIRS) -> TimedRuns:
    """Run the scene's FMU and that of its model in turn, ends recorded only; errors as for ``simulate``."""
    small, large = Fmu.open(built_scene(scene)), whole_model(scene)
    muted = _muting(scene)
    small_arguments = arguments(scene)
    everything = _for_model(scene, large, small_arguments, muted or {})
    times = np.linspace(0.0, small_arguments["stop_time"], 501)
    small_run = simulate(small, **small_arguments, output_times=times)
    large_run = simulate(large, **everything, output_times=times)
    sizes = {name: float(np.abs(small_run[name]).max()) or 1.0 for name in small.states}
    gaps = [float(np.abs(small_run[name] - large_run[name]).max()) / size for name, size in sizes.items()]
    measured: list[tuple[float, float]] = []
    end = [small_arguments["stop_time"]]
    started = time.monotonic()
    while len(measured) < pairs and (len(measured) < 3 or time.monotonic() - started < LONGEST):
        ours = simulate(small, **small_arguments, output_times=end).seconds
        measured.append((ours, simulate(large, **everything, output_times=end).seconds))
    return TimedRuns(
        scene=statistics.median(a for a, _ in measured),
        model=statistics.median(b for _, b in measured),
        faster=statistics.median(b / a for a, b in measured),
        difference=None if muted is None else max(gaps),
        muted=muted or {},
    )


def _for_model(
    scene: Scene, model: Fmu, scene_arguments: Mapping[str, Any], muted: Mapping[str, float]
) -> dict[str, Any]:
    """Arguments with which the FMU of the whole model does what the scene does."""
    fixed = {name: value for name, value in scene.fixed.items() if name in model.parameters}
    held_inputs = {name: value for name, value in scene.fixed.items() if name in model.inputs}
    return {
        **scene_arguments,
        "parameters": {**fixed, **scene_arguments["parameters"], **muted},
        "inputs": {**held_inputs, **scene_arguments["inputs"]},
    }


def _muting(scene: Scene) -> dict[str, float] | None:
    """Values of parameters of the model that take the force from every contact left out; None if there are none."""
    if scene.contacts is None:
        return {}
    whole_model = variant(scene.model, beside=scene.folder)
    reduced_model = variant(whole_model, scene.contacts)
    shared = {p.name for p in reduced_model.parameters}
    muted: dict[str, float] = {}
    for contact in whole_model.contacts:
        if contact.name in scene.contacts:
            continue
        quantities: list[Any] = [p for p in whole_model.parameters if p in contact.symbols and p.name not in shared]
        zeros = [p for p in quantities if p.minimum == 0.0 and not p.positive]
        force: Any = contact.law_force
        choices = [[p] for p in zeros] + [zeros]
        silent = next((c for c in choices if force is not None and force.xreplace(dict.fromkeys(c, 0)) == 0), None)
        if silent is None:
            return None
        muted |= {p.name: 0.0 for p in silent}
    return muted


def time_build(scene: Scene, of_model: bool) -> float:
    """Seconds to a first result with an empty cache: the FMU of the scene, or of its whole model, is built."""
    with temporary_folder("bench") as folder:
        # the compiler's own cache stays: it holds the C library, which is made once per installation
        compiler = os.environ.get("ZIG_GLOBAL_CACHE_DIR", str(cache_folder() / "zig"))
        return _first_result(scene, of_model, {"STICKSLIP_CACHE": str(folder), "ZIG_GLOBAL_CACHE_DIR": compiler})


def time_start(scene: Scene, of_model: bool) -> float:
    """Seconds to a first result with an FMU that was built before."""
    return _first_result(scene, of_model, {})


def _first_result(scene: Scene, of_model: bool, environment: Mapping[str, str]) -> float:
    started = time.perf_counter()
    isolated(_work, scene, of_model, environment)
    return time.perf_counter() - started


def _work(scene: Scene, of_model: bool, environment: Mapping[str, str]) -> None:
    """What is timed, in a process of its own."""
    os.environ.update(environment)
    scene_arguments = arguments(scene)
    fmu = whole_model(scene) if of_model else Fmu.open(built_scene(scene))
    run = _for_model(scene, fmu, scene_arguments, {}) if of_model else scene_arguments
    simulate(fmu, **run, output_times=[scene_arguments["stop_time"]])
