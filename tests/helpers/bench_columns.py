"""Columns of a bench's log under any names, written as a file, and what is said of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rig_io.description.answers import Answers

SAID = Answers(
    values={"laser": "0.01 ± 0.00002 m/V, 5 V", "encoder": "1000", "drive0": "1000", "R": "0.125 ± 0.0001"},
    confirm=True,
)


def bench_log(rows: int = 4000) -> dict[str, np.ndarray]:
    """Columns of a log of two seconds' swings, under any names."""
    time = 0.001 * np.arange(rows)
    swing = 0.2 * np.sin(12 * time)
    rng = np.random.default_rng(0)
    return {
        "time": time,
        "laser": np.round(5 + 12.5 * np.sin(swing) + rng.normal(0, 2e-3, rows), 3),
        "encoder": np.floor(swing / (2 * np.pi / 1000)),
        "drive": np.floor(0.9 * time / (2 * np.pi / 1000)),
    }


def written(folder: Path, header: str, columns: list[np.ndarray], name: str = "x.csv") -> Path:
    path = folder / name
    rows = "\n".join(";".join(f"{v:.9g}" for v in row) for row in zip(*columns, strict=True))
    path.write_text(f"{header}\n{rows}\n" if header else f"{rows}\n")
    return path
