"""Three measured machines that calibration is measured with: declarations, what is free, and where the logs are.

Cascaded tanks (levels in volts; both may overflow, the upper in part into the lower): Schoukens, Mattsson, Wigren,
Noel (2016). Bouc-Wen oscillator: Noel, Schoukens (2016). Electro-mechanical positioning system in its loop: Janot,
Gautier, Brunot (2019).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import sympy

from fmu_models.language.automaton import Automaton, Switch
from fmu_models.language.quantities import Input, Parameter, State
from identification.calibration.segments import Sensor

FINER = 8  # points of a band-limited force for each sample
Log = tuple[dict[str, np.ndarray], dict[str, tuple[np.ndarray, np.ndarray]]]  # columns; inputs at other times


def parameters(**values: float) -> list[Parameter]:
    """Parameters without units, by name."""
    return [Parameter(name, value, "1", name) for name, value in values.items()]


def tanks() -> Automaton:
    """Both overflow above hm and hl."""
    k1, k2, k3, k4, k5, kw, hm, hl, kl, u0, k6 = parameters(
        k1=0.05, k2=0.05, k3=0.05, k4=0.05, k5=0.01, kw=1.0, hm=10.0, hl=10.0, kl=0.1, u0=0.0, k6=0.0
    )
    u = Input("u", 3.0, "1", "pump")
    h1, h2 = State("h1", "1", "upper level", start=5.0), State("h2", "1", "lower level", start=5.0)
    brim, lip = Switch(name="brim", function=h1 - hm), Switch(name="lip", function=h2 - hl)
    over, spill = kw * (h1 - hm) * (1 + brim.sign) / 2, kl * (h2 - hl) * (1 + lip.sign) / 2
    q1, q3 = sympy.sqrt(h1), sympy.sqrt(h2)
    return Automaton(
        name="tanks",
        title="Cascaded tanks with overflow",
        source="Schoukens, Mattsson, Wigren, Noel (2016)",
        states=[h1, h2],
        flows={h1: -k1 * q1 + k4 * (u - u0) + k6 * (u - u0) ** 2 - over, h2: k2 * q1 - k3 * q3 + k5 * over - spill},
        switches=[brim, lip],
    )


def bouc_wen() -> Automaton:
    """m y'' + c y' + k y + z = u, z' = a y' - bg |y'| z - bd y' |z|."""
    m = Parameter("m", 2.0, "1", "mass", positive=True)
    c, k, a, bg, bd = parameters(c=10.0, k=5.0e4, a=5.0e4, bg=8.0e2, bd=-1.1e3)
    u = Input("u", 0.0, "1", "force")
    y, v, z = State("y", "1", "place"), State("v", "1", "speed"), State("z", "1", "force of hysteresis")
    turn, pull = Switch(name="turn", function=v), Switch(name="pull", function=z)
    return Automaton(
        name="bouc_wen",
        title="Bouc-Wen oscillator",
        source="Noel, Schoukens (2016)",
        states=[y, v, z],
        flows={y: v, v: (u - c * v - k * y - z) / m, z: a * v - bg * turn.abs * z - bd * v * pull.abs},
        switches=[turn, pull],
    )


def emps() -> Automaton:
    """A carriage with dry and viscous friction; its place and speed are fed back, the speed as the difference over two
    samples, v(t - late) = v - late v'. The recorded command is kv (kp (qg - q) - (q(t) - q(t - 2 late))/(2 late)) to
    4e-5 of both gains; without this delay the mass is gt kv late = 8.6 kg too small."""
    M = Parameter("M", 95.0, "1", "mass", positive=True)
    Fv, Fc, off, kp, kv = parameters(Fv=200.0, Fc=20.0, off=-3.0, kp=160.18, kv=243.45)
    gt, late = parameters(gt=35.150651882, late=1e-3)
    qg = Input("qg", 0.0, "1", "reference")
    q, v = State("q", "1", "place"), State("v", "1", "speed")
    slide = Switch(name="slide", function=v)
    force = gt * kv * (kp * (qg - q) - v)
    return Automaton(
        name="emps_in_loop",
        title="EMPS in its loop",
        source="Janot, Gautier, Brunot (2019)",
        states=[q, v],
        flows={q: v, v: (force + off - Fv * v - Fc * slide.sign) / (M - gt * kv * late)},
        switches=[slide],
    )


def tanks_log(file: Path) -> Log:
    """1 024 samples, 4 s apart."""
    time, pump, level = np.genfromtxt(file, delimiter=",", skip_header=1, unpack=True)
    return {"time": time, "u": pump, "h2": level}, {}


def bouc_wen_log(file: Path) -> Log:
    """2 048 samples at 750 Hz of the multisine, whose force is band-limited between them."""
    import h5py
    from scipy.signal import resample

    with h5py.File(file) as content:
        force, place = (np.asarray(content[f"multisine/{name}"]).ravel() for name in "uy")
    fine = np.asarray(resample(force, FINER * force.size))[: FINER * 2048]
    return {"time": np.arange(2048) / 750.0, "y": place[:2048]}, {"u": (np.arange(fine.size) / (750.0 * FINER), fine)}


def emps_log(file: Path) -> Log:
    """Each fifth of 24 841 samples; the reference by the straight lines that join all best, since those between its
    samples are too high by a twelfth of a second difference, in which a mass of 2.9 kg would hide."""
    from scipy.io import loadmat

    content = loadmat(file)
    time, reference, place = (content[name].ravel()[::5] for name in ("t", "qg", "qm"))
    reference = reference - np.pad(np.diff(reference, 2), 1) / 12
    return {"time": time, "qg": reference, "q": place}, {}


@dataclass(frozen=True)
class MeasuredCase:
    """model; file: under the folder of logs; read: what reads it; free: first values, from which seeds are off;
    reached: root mean square of the residuals of the best fit of this model that is known; settings: of
    `calibrate`."""

    model: Automaton
    file: str
    read: Callable[[Path], Log]
    free: Mapping[str, float]
    reached: float
    settings: Mapping[str, Any] = field(default_factory=dict)

    def log(self, data: Path) -> Log:
        """The measured log."""
        return self.read(data / self.file)

    def first_values(self, off: float, random: np.random.Generator) -> dict[str, float]:
        """First values by a factor off to either side, inside of what is known."""
        bounds = self.settings.get("bounds", {})
        values = {name: value * off ** random.choice([-1, 1]) for name, value in self.free.items()}
        return {name: float(np.clip(value, *bounds.get(name, (None, None)))) for name, value in values.items()}

    def missing(self, data: Path) -> str:
        """Why it cannot be searched; empty if it can."""
        return "" if (data / self.file).exists() else f"{data / self.file} is not here"


TANKS = {"k1": 0.05, "k2": 0.05, "k3": 0.05, "k4": 0.05, "k5": 0.5, "kw": 1.0, "hm": 9.0, "hl": 9.5, "kl": 0.1}
MACHINES = {
    "tanks": MeasuredCase(
        tanks(),
        "calibrate/tanks_train.csv",
        tanks_log,
        {**TANKS, "u0": 0.1, "k6": 0.001},
        0.25,
        settings={
            "sensors": {"h2": Sensor(clip=(-np.inf, 10.0))},
            "bounds": {"hm": (6.0, 12.0), "hl": (7.0, 10.5)},
            "attempts": 8,
        },
    ),
    "bouc-wen": MeasuredCase(
        bouc_wen(),
        "calibrate/bouc_wen_train.h5",
        bouc_wen_log,
        {"m": 2.0, "c": 10.0, "k": 5.0e4, "a": 5.0e4, "bg": 8.0e2, "bd": -1.1e3},
        7.3e-6,
    ),
    "emps": MeasuredCase(
        emps(), "emps/DATA_EMPS.mat", emps_log, {"M": 95.0, "Fv": 200.0, "Fc": 20.0, "off": 3.0}, 1.65e-6
    ),
}
