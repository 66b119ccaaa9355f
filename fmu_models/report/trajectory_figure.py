"""A trajectory at one glance: phase portrait and time series, stick marked."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from fmu_models.errors import StickslipError
from fmu_models.report.figures import save_figure

if TYPE_CHECKING:
    from fmu_models.simulation.fmu import Fmu
    from fmu_models.simulation.trajectory import Trajectory


def draw(trajectory: Trajectory, fmu: Fmu, path: Path, *, overwrite: bool = False) -> None:
    """Draw the first coordinate against its velocity, and both over time, with stretches of stick shaded.

    Raises:
        StickslipError: the file exists or cannot be written, or there is no second state.
    """
    states = [name for name in fmu.states if name in trajectory.values]
    if len(states) < 2:
        raise StickslipError(f"A phase portrait needs two states; {fmu.path.name} has {len(states)}. Leave it out.")
    position, velocity = states[:2]
    contacts = [name for name in fmu.contacts if fmu.ours and f"{name}_state" in trajectory.values]
    figure = Figure(figsize=(11, 4.5), layout="constrained")
    phase, series = figure.subplots(1, 2, width_ratios=(1, 1.6))
    phase.plot(trajectory[position], trajectory[velocity], color="black", linewidth=0.8)
    phase.plot(trajectory[position][0], trajectory[velocity][0], "o", color="black", markersize=4, label="start")
    phase.set_xlabel(_label(trajectory, position))
    phase.set_ylabel(_label(trajectory, velocity))
    phase.legend(loc="lower left", frameon=False)
    series.plot(trajectory.time, trajectory[position], color="black", linewidth=1.0, label=position)
    series.set_xlabel("time (s)")
    series.set_ylabel(_label(trajectory, position))
    speed = series.twinx()
    speed.plot(trajectory.time, trajectory[velocity], color="tab:blue", linewidth=0.8, linestyle="--", label=velocity)
    speed.set_ylabel(_label(trajectory, velocity))
    sticking = np.any([trajectory[f"{name}_state"] == 0 for name in contacts], axis=0) if contacts else None
    if sticking is not None and sticking.any():
        low, high = series.get_ylim()
        series.fill_between(trajectory.time, low, high, where=sticking, color="0.88", linewidth=0, label="stick")
        series.set_ylim(low, high)
    lines = [*series.get_legend_handles_labels()[0], *speed.get_legend_handles_labels()[0]]
    labels = [line.get_label() for line in lines]
    series.legend(lines, labels, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, frameon=False)
    phase.set_title(fmu.description.modelName)
    save_figure(figure, path, overwrite=overwrite)


def _label(trajectory: Trajectory, name: str) -> str:
    return f"{name} ({trajectory.units[name]})"
