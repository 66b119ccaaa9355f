"""Logs of machines of one degree of freedom with known truth, and recipes for them, as files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from rig_io.logs.table import Table
from rig_io.readers.csv_log import write

RATE = 1000.0  # Hz

# everything measured, so that nothing is lost in derivatives
MEASURED = """title = "a slide"

[signals.time]
column = "time"
unit = "s"

[signals.position]
column = "x"
unit = "m"

[signals.velocity]
column = "v"
unit = "m/s"

[signals.acceleration]
column = "a"
unit = "m/s2"

[signals.effort]
column = "F"
unit = "N"
"""
# friction over weight alone, as slips are told from
FRICTION = """
[signals.time]
column = "time"
unit = "s"

[signals.friction]
column = "f"
unit = "1"
"""
LINEAR = """
[terms]
M = "inertia"
Fv = "viscous"
Fc = "coulomb"
offset = "offset"
"""

Effort = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def motion(duration: float = 10.0) -> dict[str, np.ndarray]:
    """Time, s, and x, v, a of a motion of several frequencies, none of which is a multiple of another."""
    time = np.arange(round(duration * RATE)) / RATE
    w1, w2 = 2 * np.pi * 0.7, 2 * np.pi * 1.9 * np.sqrt(1.1)
    return {
        "time": time,
        "x": 0.1 * np.sin(w1 * time) + 0.02 * np.cos(w2 * time),
        "v": 0.1 * w1 * np.cos(w1 * time) - 0.02 * w2 * np.sin(w2 * time),
        "a": -0.1 * w1**2 * np.sin(w1 * time) - 0.02 * w2**2 * np.cos(w2 * time),
    }


def slide(x: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Effort of a slide: 5 kg, 12 N s/m, 3 N, offset -0.5 N."""
    return 5 * a + 12 * v + 3 * np.sign(v) - 0.5


def log_of(folder: Path, effort: Effort = slide, noise: np.ndarray | float = 0.0, name: str = "log") -> Path:
    """A CSV log of the motion with the effort of a machine."""
    columns = motion()
    path = folder / f"{name}.csv"
    write(path, {**columns, "F": effort(columns["x"], columns["v"], columns["a"]) + noise})
    return path


def table_of(effort: Effort = slide, noise: np.ndarray | float = 0.0) -> Table:
    """The same log as a reader would give it."""
    columns = motion()
    return Table("a log", {**columns, "F": effort(columns["x"], columns["v"], columns["a"]) + noise}, {}, 2)


def recipe_of(folder: Path, text: str = MEASURED + LINEAR, name: str = "recipe") -> Path:
    """A recipe as a file."""
    path = folder / f"{name}.toml"
    path.write_text(text)
    return path


def coloured(count: int, colour: float, rng: np.random.Generator) -> np.ndarray:
    """First-order autoregression (count,) of unit variance."""
    from scipy.signal import lfilter

    white = rng.normal(size=count + 1000) * np.sqrt(1 - colour**2)
    return np.asarray(lfilter([1.0], [1.0, -colour], white))[1000:]
