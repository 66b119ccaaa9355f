"""Loops of force over displacement by other means than the suite's: sample by sample, with noise that nobody tells."""

from __future__ import annotations

import numpy as np

from identification import LoopLog


def growing(samples: int = 1200, cycles: int = 6, reach: float = 1.0) -> np.ndarray:
    """A way whose amplitude grows from a fifth of ``reach``."""
    phase = np.linspace(0.0, 2 * np.pi * cycles, samples)
    return reach * (0.2 + 0.8 * phase / phase[-1]) * np.sin(phase)


def of_sliders(way: np.ndarray, stiffness: list[float], bound: list[float]) -> np.ndarray:
    """Forces of springs behind sliders."""
    z, forces = np.zeros(len(bound)), [0.0]
    for step in np.diff(way):
        z = np.minimum(np.maximum(z + step, -np.array(bound)), bound)
        forces.append(float(np.dot(stiffness, z)))
    return np.array(forces)


def of_dahl(way: np.ndarray, sigma: float, full: float) -> np.ndarray:
    """Forces of Dahl's law, by its closed form over each sample."""
    forces = [0.0]
    for step in np.diff(way):
        end = np.sign(step) * full
        forces.append(end + (forces[-1] - end) * np.exp(-sigma * abs(step) / full))
    return np.array(forces)


def of_bouc_wen(way: np.ndarray, k: float, beta: float, gamma: float, n: float, parts: int = 40) -> np.ndarray:
    """Forces of Bouc and Wen's law, by RK4 in so many parts of each sample."""

    def rate(z: float, sense: float) -> float:
        return 1.0 - abs(z) ** n * (gamma + beta * sense * np.sign(z))

    z, forces = 0.0, [0.0]
    for step in np.diff(way):
        h, sense = step / parts, np.sign(step)
        for _ in range(parts):
            a = rate(z, sense)
            b = rate(z + h * a / 2, sense)
            c = rate(z + h * b / 2, sense)
            z += h * (a + 2 * b + 2 * c + rate(z + h * c, sense)) / 6
        forces.append(k * z)
    return np.array(forces)


def noisy(way: np.ndarray, force: np.ndarray, seed: int, *, of_way: float = 0.0, of_force: float = 0.0) -> LoopLog:
    """A log with noise in parts of the range of the way and of the force."""
    rng = np.random.default_rng(seed)
    seen = [v + part * np.ptp(v) * rng.normal(size=len(v)) for v, part in ((way, of_way), (force, of_force))]
    return LoopLog(f"loop {seed}", *seen)
