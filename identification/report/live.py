"""The fitted model live over the measured portraits, in a frame: sliders within the intervals of the fit.

The frame computes by the engine of `fmu_models.explorer`. How a motion becomes a portrait, and what is judged of it, is
that of `model_check`, written once more in web/*.mjs with the levels of here.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from fmu_models.base.version import version
from fmu_models.explorer.bundle import WEB, framed, single_file
from fmu_models.explorer.module import wasm
from identification.fit.result import FrictionFit
from identification.fitted_model.model import (
    TRANSIENT,
    FittedModel,
    arrangement_of,
    fitted_model,
    fmu_parameters,
    inputs,
)
from identification.laws import find_law
from identification.measurement.motion import SMOOTHING, odd_count
from identification.model_check import processing
from identification.model_check.bifurcations import COVER
from identification.model_check.families import FamilyComparison, processing_of
from identification.model_check.portraits import (
    LIMITS,
    PHASES,
    SCANLINES,
    Portrait,
    PortraitComparison,
    Rest,
    sequence_of,
)

HERE = Path(__file__).parent / "web"
SCRIPTS = (
    *(WEB / name for name in ("engine.mjs", "plot.mjs", "elements.mjs")),
    *(HERE / name for name in ("processing.mjs", "portraits.mjs", "live.mjs")),
)
MOST = 120_000  # bytes of the frame
HEIGHT = 720  # pixels
UNKNOWN = 0.1  # part of a value, to either side, where nobody says how well it is known
AWAY = 1000.0  # rad/s, drive speed of a disc that does not touch: its slip never ends
FINENESS = 1e-5  # of a half range, to which measured curves are kept: a hundredth of what a metric is shown to


@dataclass(frozen=True)
class LiveFrame:
    """html: the frame, empty where nothing can move; notes: what it leaves out, and why. A notebook shows both."""

    html: str
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        return "\n".join([f"LiveFrame({len(self.html.encode()) / 1000:.0f} kB)", *self.notes])

    def _repr_html_(self) -> str:
        return self.html + "".join(f"<p>{escape(note)}</p>" for note in self.notes)


def live_frame(fit: FrictionFit, families: Sequence[FamilyComparison]) -> LiveFrame:
    """The frame of a fit and the families that were compared with it by `compare_families`.

    Raises:
        StickslipError: the law is unknown, or the compiler fails.
    """
    notes: list[str] = []
    described: list[dict[str, Any]] = []
    modules: dict[tuple[str, ...], bytes] = {}
    html = ""
    # where contact does not depend on the angle, a disc that does not touch is one without normal force
    shared = arrangement_of(fit) == "together"
    for family in families:
        discs = tuple(family.members[0].drive_speeds)
        logs = [member for member in family.members if member.settling is None and member.length > 0.0]
        left = [member.log for member in family.members if member not in logs]
        notes += [f"Not among the live portraits, for it begins before it has settled: {name}." for name in left]
        model = fitted_model(fit, contacts=None if shared else discs)
        if not model.sticks:
            notes.append(f"The portraits are not live: the law '{fit.law}' has bristles, whose motion takes too long.")
        if not model.sticks or not logs:
            continue
        made = modules if model.contacts in modules else {**modules, model.contacts: wasm(model.fmu)}
        more = [*described, {"engine": list(made).index(model.contacts), **_family(fit, model, discs, logs)}]
        page = _page(more, list(made.values()))
        if len(page.encode()) > MOST:
            notes.append(f"Not live, for want of room in the page: the portraits of {' and '.join(discs)}.")
            continue
        described, modules, html = more, made, page
    return LiveFrame(html, tuple(notes))


def _page(families: Sequence[Mapping[str, Any]], modules: Sequence[bytes]) -> str:
    data = json.dumps(families, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode()
    style = (WEB / "page.css").read_text("utf-8") + (HERE / "live.css").read_text("utf-8")
    title = "The fitted model over the measured portraits"
    packed = {"data": data, **{f"engine{i}": module for i, module in enumerate(modules)}}
    page = single_file(
        HERE / "live.html.j2", SCRIPTS, style, packed, title=title, engines=len(modules), version=version()
    )
    return framed(page, title, HEIGHT)


def _family(
    fit: FrictionFit, model: FittedModel, discs: Sequence[str], logs: Sequence[PortraitComparison]
) -> dict[str, Any]:
    """A family of the discs that touch, as the page has it: places are those of values in the engine's order."""
    fmu = model.fmu
    rates = [f"{name}_rate" for name in fmu.inputs]
    order = [*fmu.parameters, *fmu.inputs, *rates, *fmu.states, *fmu.memories]
    given = {**model.parameters, **model.start}
    for contact in set(model.contacts) - set(discs):
        given |= {f"N{contact[-1]}": 0.0, **inputs({contact: AWAY})}
    starts = {name: given.get(name, fmu.variables[name].start) for name in order if name not in rates}
    sliders, places = [], {"J": [order.index("J")]}
    for name, parameter, low, high, known in _ranges(fit, model, discs):
        variable = fmu.variables[parameter]
        places[name] = [order.index(parameter)]
        sliders.append(
            {
                **{"name": name, "unit": variable.unit or "1", "meaning": variable.description or ""},
                **{"value": model.parameters[parameter], "low": low, "high": high, "known": known},
            }
        )
    drives = {contact: order.index(next(iter(inputs({contact: 0.0})))) for contact in discs}
    return {
        "inputs": drives,
        "angle": order.index("theta"),
        "speed": order.index("omega"),
        "angleColumn": 1 + fmu.states.index("theta"),
        "speedColumn": 1 + fmu.states.index("omega"),
        "places": places,
        "values": [float(starts.get(name) or 0.0) for name in order],
        "sliders": sliders,
        "levels": _levels(model),
        "logs": [_log(model, discs[0], log) for log in logs],
    }


def _ranges(fit: FrictionFit, model: FittedModel, discs: Sequence[str]) -> list[tuple[str, str, float, float, bool]]:
    """Name in the fit and in the FMU, interval, and whether it is known: of the law, the normal forces and k."""
    found = []
    constants = {constant.name: constant.standard_uncertainty for constant in fit.constants if constant.stated}
    constants |= {one.name: one.total_deviation for one in fit.nuisance}
    values = {constant.name: constant.value for constant in (*fit.constants, *fit.nuisance)}

    def spread(*names: str) -> float:
        """Relative standard deviation of a product of constants; nan where one of them is not known."""
        parts = [constants[name] / values[name] if name in constants else np.nan for name in names]
        return float(np.hypot.reduce(parts))

    several = len(fit.contacts) > 1
    for contact in discs:
        suffix = contact[-1] if several else ""
        for name in find_law(fit.law_reference).names:
            found.append((f"{name}{suffix}", f"{name}{contact[-1]}", *fit.interval(f"{name}{suffix}")))
        force = fmu_parameters(fit)[f"N{contact[-1]}"]
        reach = COVER * spread(f"N{suffix}") * force
        found.append((f"N{suffix}", f"N{contact[-1]}", force - reach, force + reach))
    k = model.parameters["k"]
    reach = COVER * (spread("k") if "k" in values else spread("k/J", "J")) * k
    found.append(("k", "k", k - reach, k + reach))
    made = []
    for name, parameter, low, high in found:
        value = model.parameters[parameter]
        known = bool(np.isfinite([low, high]).all() and low < high)
        around = UNKNOWN * (abs(value) or 1.0)
        ends = (float(low), float(high)) if known else (value - around, value + around)
        made.append((name, parameter, *ends, known))
    return made


def _levels(model: FittedModel) -> dict[str, Any]:
    """What `model_check` holds motions to, by the names of the page."""
    made = processing_of(model)
    return {
        **{"r": made.r, "R": made.R, "threshold": made.threshold, "arrangement": made.arrangement},
        **{"changeover": made.changeover, "window": SMOOTHING * made.natural_period},
        **{"resting": processing.RESTING, "dying": processing.DYING, "hysteresis": processing.HYSTERESIS},
        **{"leastCycles": processing.LEAST_CYCLES, "irregular": processing.IRREGULAR, "zero": processing.ZERO},
        **{"phases": PHASES, "scanlines": SCANLINES, "limits": LIMITS, "shortest": LIMITS["stick fraction"]},
        "transient": TRANSIENT * model.natural_period,
    }


def _log(model: FittedModel, first: str, one: PortraitComparison) -> dict[str, Any]:
    return {
        "name": one.log,
        "drives": dict(one.drive_speeds),
        "begin": model.parameters["r"] * one.drive_speeds[first] / model.parameters["R"],
        "length": one.length,
        "step": one.step,
        "half": odd_count(SMOOTHING * model.natural_period, one.step) // 2,
        "measured": _measured(one.measured),
    }


def _measured(motion: Portrait | Rest) -> dict[str, Any]:
    if isinstance(motion, Rest):
        return {"rest": motion.angle, "swing": motion.swing, "words": motion.words}
    return {
        "angle": _folded(motion.angle),
        "speed": _folded(motion.speed),
        "period": motion.period,
        "amplitude": motion.amplitude,
        "sticks": {name: {"fraction": stick.fraction} for name, stick in motion.sticks.items()},
        "sequence": sequence_of(motion),
        "words": motion.words,
    }


def _folded(curve: np.ndarray) -> tuple[list[int], float]:
    """A smooth curve (n,) as differences of differences, which pack well, and their unit."""
    unit = FINENESS * float(np.ptp(curve)) / 2
    return np.diff(np.round(curve / unit).astype(int), 2, prepend=[0, 0]).tolist(), unit
