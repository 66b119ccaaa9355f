"""A scene of the disc rig as the bench would see it: logs to be emulated, one per value of what the scene varies.

    [sensors]
    laser = true             fitted or not; likewise encoder (of the body), drive_encoder, ripple (of the drives)
    transient = "5 s"        before the log begins; 0 without a disc in contact
    duration = "20 s"        of each log
    sampling_rate = "1 kHz"
    holds = ["0.3 s", "3 s", "30 s"]   for which the drive stops, one after the other; none if left out
    smoothing = "20 ms"      of the drives' ripple; 0 if left out, which hides ageing

Sensors are those of the paper with the standard faults; what is left out is as shown. The drives may be uneven, so that
speeds which the scene holds are inputs again.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.scene.scene import Drive, Scene
from rig_io.bench.drive import Ripple, held_duration
from rig_io.bench.emulation import RIG, Disc, Emulation
from rig_io.bench.materials import MATERIALS, Material
from rig_io.logs.arrangement import MODELS, Arrangement
from rig_io.logs.log import RigConstants
from rig_io.sensors.encoder import Encoder
from rig_io.sensors.laser import Laser

_FITTED: dict[str, Callable[[], Any]] = {"laser": Laser, "encoder": Encoder, "drive_encoder": Encoder, "ripple": Ripple}
_TIMES = {"transient": "s", "duration": "s", "sampling_rate": "1/s"}


def emulations(scene: Scene) -> list[Emulation]:
    """The emulations that a scene asks for.

    Raises:
        StickslipError: it is not of the disc rig, varies something else than a drive, has a drive that is not steady,
            or its sensors are not those of the rig.
    """
    if scene.model not in MODELS.values():
        raise StickslipError(
            f"{scene.path}: '{scene.model}' is not the rig, so that no bench can be emulated for it. The rig's models "
            f"are {', '.join(MODELS.values())}."
        )
    settings = _sensors(scene)
    over, values = scene.compute.over, scene.compute.values
    if over is None:
        return [_emulation(scene, scene.name, settings)]
    if over not in scene.drives:
        raise StickslipError(f"{scene.path}: logs differ by the speeds of their drives, not by '{over}'. Vary a drive.")
    return [
        _emulation(
            replace(scene, drives={**scene.drives, over: Drive(times=(0.0,), values=(value,))}),
            f"{scene.name}-{value:g}",
            settings,
        )
        for value in values
    ]


def _emulation(scene: Scene, name: str, settings: dict[str, Any]) -> Emulation:
    values = scene.parameters
    contacts = ("disc0", "disc1") if scene.contacts is None else scene.contacts
    if contacts not in ((), ("disc0",), ("disc0", "disc1")):
        raise StickslipError(f"{scene.path}: the bench is emulated with disc 0, both discs or none, not {contacts}.")
    discs = tuple(Disc(_material(values, i), _speed(scene, f"w{i}")) for i in range(len(contacts)))
    names = ("J", "k", "c", "R", "r", "N0", "N1")
    rig = RigConstants(
        **{key: replace(getattr(RIG, key), value=values.get(key, getattr(RIG, key).value)) for key in names}
    )
    arrangement: Arrangement = "together"
    if len(discs) == 2:
        arrangement = next(key for key, model in MODELS.items() if model == scene.model)
    start = scene.start.get("theta", 0.0)
    return Emulation(name, discs, rig, arrangement, scene=scene, start_angle=start, **settings)


def _material(values: dict[str, float], i: int) -> Material:
    """The pair on disc i, by its name if it is one of the paper's."""
    law = {name[:-1]: value for name, value in values.items() if name.endswith(str(i)) and name != f"N{i}"}
    pair = {name: law[name] for name in ("mu_s", "mu_k", "p") if name in law}
    if len(pair) < 3:  # another law than the pairs of the paper have
        return Material(", ".join(f"{name} {value:g}" for name, value in law.items()), law)
    materials = (m for m in MATERIALS.values() if m.values == pair)
    return next(materials, Material("mu_s {mu_s:g}, mu_k {mu_k:g}, p {p:g} s/m".format(**pair), pair))


def _speed(scene: Scene, name: str) -> float:
    """Nominal speed of a drive, rad/s."""
    if name in scene.fixed:
        return scene.fixed[name]
    speed = scene.drives[name].constant
    if speed is None:
        raise StickslipError(
            f"{scene.path}: drive '{name}' varies in time; the emulated bench drives at steady speeds."
        )
    return speed


def _sensors(scene: Scene) -> dict[str, Any]:
    """Settings of an Emulation from the table of the sensors."""
    settings: dict[str, Any] = {}
    smoothing = 0.0
    names = (*_FITTED, *_TIMES, "holds", "smoothing")
    for key, raw in scene.sensors.items():
        where = f"{scene.path}, line {scene.lines[key]}"
        refuse_unknown(key, names, f"{where}: '{key}' is not a key in [sensors].")
        if key in _FITTED:
            if not isinstance(raw, bool):
                raise StickslipError(f"{where}: '{key}' must be true or false, found {raw!r}.")
            settings[key] = _FITTED[key]() if raw else None
        elif key == "holds":
            if not isinstance(raw, list):
                raise StickslipError(f"{where}: 'holds' must be a list of times, found {raw!r}.")
            settings[key] = tuple(_quantity(hold, "s", f"{where}: 'holds'") for hold in raw)
        elif key == "smoothing":
            smoothing = _quantity(raw, "s", f"{where}: '{key}'")
        else:
            settings[key] = _quantity(raw, _TIMES[key], f"{where}: '{key}'")
    defaults: dict[str, float] = {}
    if scene.contacts == ():
        defaults["transient"] = 0.0  # a free decay would be over
    if settings.get("holds") and "duration" not in settings:
        defaults["duration"] = held_duration(settings["holds"])
    if settings.get("ripple", True) is not None:
        settings["ripple"] = Ripple(smoothing=smoothing)
    return {**defaults, **settings}


def _quantity(raw: object, unit: str, label: str) -> float:
    """A number in ``unit``, or a text of number and unit."""
    from fmu_models.base.toml_document import converted

    if isinstance(raw, bool) or not isinstance(raw, int | float | str):
        raise StickslipError(f"{label} must be a number in {unit} or a text with a unit, found {raw!r}.")
    value = converted(raw, unit, label) if isinstance(raw, str) else float(raw)
    if not math.isfinite(value):
        raise StickslipError(f"{label} must be a finite number, found {value}.")
    return value
