"""Logs of the two-link arm in data/machines, emulated.

The trajectory is given, and the torques that it takes follow from Lagrange's equations, typed here by hand. What the
sensors show is not what the estimators assume: positions in counts of an encoder, torques with the noise of a current
loop and a ripple of the teeth.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from identification.machines.motion import MachineLog

ARM: dict[str, float] = {
    **{"g": 9.81, "l1": 0.3, "J1": 0.06, "J2": 0.025, "m1": 1.2, "r1": 0.16, "m2": 0.8, "r2": 0.14},
    **{"b1": 0.08, "b2": 0.03, "f1": 0.25, "f2": 0.1},
}
COUNT = 2 * np.pi / 8192  # rad
RATE = 250.0  # Hz
HARMONICS = 5
BASE = 0.15  # Hz, of the trajectory


def torques(q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """What the motion takes, N m; all (n, 2)."""
    p = ARM
    h = p["m2"] * p["l1"] * p["r2"]
    cosine, sine = np.cos(q[:, 1]), np.sin(q[:, 1])
    upper = p["J1"] + p["J2"] + p["m2"] * p["l1"] ** 2 + 2 * h * cosine
    both, lower = p["J2"] + h * cosine, p["J2"]
    weight = p["m2"] * p["r2"] * p["g"] * np.sin(q[:, 0] + q[:, 1])
    shoulder = (
        upper * a[:, 0]
        + both * a[:, 1]
        - h * sine * (2 * v[:, 0] * v[:, 1] + v[:, 1] ** 2)
        + (p["m1"] * p["r1"] + p["m2"] * p["l1"]) * p["g"] * np.sin(q[:, 0])
        + weight
        + p["b1"] * v[:, 0]
        + p["f1"] * np.sign(v[:, 0])
    )
    elbow = both * a[:, 0] + lower * a[:, 1] + h * sine * v[:, 0] ** 2 + weight + p["b2"] * v[:, 1]
    return np.stack([shoulder, elbow + p["f2"] * np.sign(v[:, 1])], axis=1)


def log(seed: int, duration: float = 10.0) -> MachineLog:
    """One log of a Fourier trajectory of its own."""
    rng = np.random.default_rng(seed)
    time = np.arange(int(duration * RATE)) / RATE
    order = np.arange(1, HARMONICS + 1)
    wave = 2 * np.pi * BASE * order
    sines, cosines = rng.normal(0.0, 0.7, (2, 2, HARMONICS)) / np.sqrt(order)
    phase = wave[:, None] * time
    q = (sines @ np.sin(phase) + cosines @ np.cos(phase)).T
    v = ((sines * wave) @ np.cos(phase) - (cosines * wave) @ np.sin(phase)).T
    a = (-(sines * wave**2) @ np.sin(phase) - (cosines * wave**2) @ np.cos(phase)).T
    tau = torques(q, v, a) + 0.01 * np.sin(50 * q + rng.uniform(0, 2 * np.pi, 2))
    noise = np.asarray(lfilter([0.015], [1, -0.7], rng.normal(size=tau.shape), axis=0))
    tau = tau + noise
    return MachineLog(f"arm-{seed}", time, COUNT * np.floor(q / COUNT + rng.uniform(size=2)), tau)


def table(seed: int) -> dict[str, np.ndarray]:
    """The same as columns, rounded as in a file."""
    one = log(seed)
    columns = {"time": one.time, "q1": one.position[:, 0], "q2": one.position[:, 1]}
    columns |= {"tau1": one.effort[:, 0], "tau2": one.effort[:, 1]}
    return {name: np.round(values, 5) for name, values in columns.items()}
