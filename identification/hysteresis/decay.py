"""Decays of an oscillator that nothing drives: what stops it, from its swings alone.

    q'' + w0^2 q + sgn(q') (f + c |q'| + b q'^2) = 0,    at rest where |w0^2 q| <= f        (sin q of a pendulum)

Everything is over the inertia: f dry, c viscous and b quadratic friction. Half a cycle takes from the amplitude A

    2 f/w0^2 + (pi c/(2 w0)) A + (4/3) b A^2

which gives the first values by non-negative least squares; the fit is that of the whole motion, through its turns and
to where it sticks. Source: Kelly, Fundamentals of Mechanical Vibrations (2000), section 3.7, for the first two terms.
"""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.dry_friction import DryFriction
from fmu_models.language.friction import Friction
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Parameter
from identification.calibration.calibrate import calibrate
from identification.calibration.log import ModelLog, Reading
from identification.calibration.result import Calibration
from identification.hysteresis.loop import scatter
from identification.hysteresis.read import columns_by_role, numbers_by_role
from rig_io.readers import read_table

ROLES = {"time": r"t(ime)?|zeit", "angle": r"angle|theta|phi|winkel|q|x|y|pos\w*|disp\w*|encoder"}
FLOOR = 0.02  # of the largest swing: smaller ones are noise
FEWEST = 4  # half cycles
NOISES, WHITE = 3.0, 1e-6  # of the noise: what is left that is said; or the chance of its colour
BENT = 2e-3  # of a period: its change with the amplitude that is said
FALLEN = 0.8  # of the first swing: the last of a decay is smaller
HELD = 1.1  # times a half cycle: a first one that was held before
GROWS = 1.02  # times the swing before: one that is driven
MOST = 2000  # samples of a decay
RATES = ("f", "c", "b")
DECAY = "decay"  # what columns of its logs are for


@dataclass(frozen=True)
class Drag(DryFriction):
    """Dry, viscous and quadratic friction in parts of the inertia ``J``."""

    J: sympy.Expr
    f: sympy.Expr
    c: sympy.Expr
    b: sympy.Expr

    def magnitude(self, speed: sympy.Expr) -> sympy.Expr:
        """Moment for an angular speed without sign."""
        return self.J * (self.f + self.c * speed + self.b * speed**2)


def decay_model(*, pendulum: bool) -> Mechanism:
    """The oscillator; ``pendulum``: gravity brings it back, else a spring."""
    J = Parameter("J", 1.0, "kg m2", "moment of inertia, which a decay does not tell", positive=True)
    w0 = Parameter("w0", 1.0, "rad/s", "natural frequency of small swings", positive=True)
    f = Parameter("f", 0.0, "1/s2", "dry friction over inertia", minimum=0.0)
    c = Parameter("c", 0.0, "1/s", "viscous friction over inertia", minimum=0.0)
    b = Parameter("b", 0.0, "1", "quadratic friction over inertia", minimum=0.0)
    zero = Parameter("zero", 0.0, "rad", "reading where the spring is at rest")
    q = Coordinate("angle", "rad", "reading of the angle", velocity="rate")
    return Mechanism(
        name="decaying_pendulum" if pendulum else "decaying_oscillator",
        title="Oscillator that friction brings to rest",
        source="identification.hysteresis.decay",
        coordinates=[q],
        kinetic_energy=J * q.v**2 / 2,
        potential_energy=J * w0**2 * ((1 - sympy.cos(q - zero)) if pendulum else (q - zero) ** 2 / 2),
        contacts=[Friction(name="bearing", slip=q.v, law=Drag(J, f, c, b))],
    )


def fit_decays(
    logs: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    *,
    pendulum: bool = False,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    reader: str | None = None,
    progress: Callable[[float], None] | None = None,
) -> Calibration:
    """Natural frequency and friction over inertia from logs of free decays, all together.

    Args:
        logs: files with a time and an angle (or a displacement, then read m for rad); each may hold several decays.
        pendulum: whether gravity brings it back.
        columns, units: of the roles "time" and "angle", where the file does not tell.
        reader: of the user, for a kind of file of his own.
        progress: called with the fraction done.

    Raises:
        StickslipError: a file that cannot be read, or without a decay of `FEWEST` half cycles.
    """
    paths = [logs] if isinstance(logs, str | os.PathLike) else list(logs)
    decays = [log for path in paths for log in read_decays(path, columns=columns, units=units, reader=reader)]
    firsts = [_first(log.time, log.measured["angle"]) for log in decays]
    first = {name: float(np.median([values[name] for values in firsts])) for name in firsts[0]}
    first |= {name: max(first[name], 1e-3 * first[f"{name} of all"]) for name in RATES}
    start = {name: first[name] for name in ("w0", *RATES, "zero")}
    bounds = {name: (0.0, 10 * first[f"{name} of all"]) for name in RATES}
    calibration = calibrate(
        f"identification.hysteresis.models:decaying_{'pendulum' if pendulum else 'oscillator'}",
        [thinned(log) for log in decays],
        free=list(start),
        parameters=start,
        starts=["angle", "rate"],
        bounds=bounds,
        guesses=1,
        attempts=1,
        progress=progress,
    )
    notes = [note for log in decays for note in _unlike(log, calibration, pendulum)]
    reading = Reading(columns or {}, roles=DECAY, units=units or {})
    title = f"Decay of {', '.join(calibration.logs)}: friction over inertia"
    return replace(calibration, title=title, reading=reading, warnings=(*calibration.warnings, *notes))


def thinned(decay: ModelLog) -> ModelLog:
    """With `MOST` samples at most."""
    return decay.every(max(len(decay.time) // MOST, 1))


def read_decays(
    path: str | os.PathLike[str],
    *,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    reader: str | None = None,
) -> tuple[ModelLog, ...]:
    """The decays of a file, angles in rad, without what is driven; arguments and errors as those of `fit_decays`."""
    path, units = Path(path), units or {}
    table = read_table(path, reader)
    named = columns_by_role(table, columns or {}, ROLES, ("time", "angle"), {2: ("time", "angle")})
    unit = units.get("angle") or table.units.get(named["angle"]) or "rad"
    # of a displacement the same equation holds
    expected = {"time": "s", "angle": "m" if unit.endswith("m") else "rad"}
    scaled, _ = numbers_by_role(table, named, units, expected)
    time, angle = scaled["time"], scaled["angle"]
    parts = _falling(time, angle)
    if not parts:
        raise StickslipError(
            f"{path.name} shows no decay of {FEWEST} half cycles, each smaller than the one before. Record what swings "
            "freely until it rests, from a large angle."
        )
    names = [path.name] if len(parts) == 1 else [f"{path.name}, decay {i}" for i in range(1, len(parts) + 1)]
    return tuple(
        ModelLog(name, time[a:b] - time[a], {"angle": angle[a:b]}) for name, (a, b) in zip(names, parts, strict=True)
    )


def _peaks(angle: np.ndarray) -> np.ndarray:
    """Samples (k,) of the turns between swings of more than `FLOOR` of the largest."""
    resting_angle = float(np.median(angle[-max(len(angle) // 20, 1) :]))
    away, least = angle - resting_angle, FLOOR * np.ptp(angle)
    side = np.where(away > least, 1, np.where(away < -least, -1, 0))
    outside = np.flatnonzero(side)
    if not len(outside):
        return np.zeros(0, dtype=int)
    bounds = np.flatnonzero(np.diff(side[outside]) != 0) + 1
    groups = np.split(outside, bounds)
    return np.array([group[np.argmax(np.abs(away[group]))] for group in groups if len(group)])


def _falling(time: np.ndarray, angle: np.ndarray) -> list[tuple[int, int]]:
    """First and last sample of stretches whose swings fall, from a turn on."""
    peaks = _peaks(angle)
    if len(peaks) < FEWEST + 1:
        return []
    swings = np.abs(np.diff(angle[peaks]))
    starts = [0, *(i + 1 for i in range(len(swings) - 1) if swings[i + 1] > GROWS * swings[i]), len(swings)]
    stretches = []
    for first, last in pairwise(starts):
        if last - first < FEWEST or swings[last - 1] > FALLEN * swings[first]:
            continue
        end = len(angle) if last == len(swings) else int(peaks[last - 1])
        halves = np.diff(time[peaks[first : last + 1]])
        half = float(np.median(halves))
        rests = np.searchsorted(time, time[peaks[min(last, len(peaks) - 1)]] + 4 * half)
        # what drives or holds it may do so until within the first swing
        led = first > 0 or halves[0] > HELD * half
        stretches.append((int(peaks[first + led]), min(end, int(rests))))
    return stretches


def _unlike(log: ModelLog, found: Calibration, pendulum: bool) -> list[str]:
    """What in a decay such an oscillator cannot do."""
    name, time, angle = log.name, log.time, np.asarray(log.measured["angle"])
    line = next(line for line in found.residuals if line.log == name)
    noise = max(scatter(angle), float(np.min(np.abs(np.diff(np.unique(angle))), initial=np.inf)) / np.sqrt(12))
    if line.rms < NOISES * noise and line.chance > WHITE:
        return []
    away = angle - found.values["zero"]
    before = np.flatnonzero(away[:-1] * away[1:] < 0)
    through = time[before] - away[before] * (time[before + 1] - time[before]) / (away[before + 1] - away[before])
    swings = np.array([np.abs(away[a : b + 1]).max() for a, b in pairwise(before)])
    large = swings > np.sqrt(FLOOR) * np.max(swings, initial=0.0)
    advice = (
        f"{name} leaves {line.rms:.3g} rad, for its noise of {noise:.3g}, and not by chance: values may be off by more "
        "than their intervals."
    )
    if large.sum() < FEWEST:
        return [advice]
    # a half cycle of amplitude A lasts longer by A^2/16 under gravity
    slope, intercept = np.polyfit(swings[large] ** 2, np.diff(through)[large], 1)
    longer = 16 * slope / intercept - pendulum
    if abs(longer) * np.max(swings) ** 2 / 16 < BENT:
        return [f"{advice} Look at friction that is larger at rest or uneven, at pushes, at the sensor."]
    if not pendulum and 0.7 < longer < 1.3:
        return [f"{advice} Its period grows with the amplitude as gravity has it: say --pendulum."]
    return [f"{advice} Its spring {'softens' if longer > 0 else 'stiffens'} with the angle; start from smaller swings."]


def _first(time: np.ndarray, angle: np.ndarray) -> dict[str, float]:
    """First values, and what each kind of friction would be if it were all there is."""
    from scipy.optimize import nnls

    peaks = _peaks(angle)
    swings = np.abs(np.diff(angle[peaks])) / 2
    w0 = np.pi / float(np.median(np.diff(time[peaks])))
    fall, mean = swings[:-1] - swings[1:], (swings[:-1] + swings[1:]) / 2
    # two half cycles lie between the middles of neighbouring swings, less one: one
    columns = np.column_stack([np.full(len(mean), 2 / w0**2), np.pi / (2 * w0) * mean, 4 / 3 * mean**2])
    rates, _ = nnls(columns, fall)
    alone = [max(float(fall @ column / (column @ column)), 1e-12) for column in columns.T]
    values = dict(zip(RATES, map(float, rates), strict=True))
    values |= {f"{name} of all": value for name, value in zip(RATES, alone, strict=True)}
    return values | {"w0": w0, "zero": float(np.median(angle[-max(len(angle) // 20, 1) :]))}
