"""A trajectory at one glance: phase portrait and time series; stick and closed rigid contacts marked."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.contact_states import OPEN, STICK
from fmu_models.report.figures import save_figure

if TYPE_CHECKING:
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.simulation.trajectory import Trajectory


def draw(trajectory: Trajectory, fmu: Fmu, path: Path, *, overwrite: bool = False) -> None:
    """Draw the first coordinate against its velocity, and both over time, with stretches of stick or closure shaded.

    Raises:
        StickslipError: the file exists or cannot be written, or there is no second state.
    """
    states = [name for name in fmu.states if name in trajectory.values]
    if len(states) < 2:
        raise StickslipError(f"A phase portrait needs two states; {fmu.path.name} has {len(states)}. Leave it out.")
    position, velocity = states[0], _velocity(fmu) if fmu.ours else states[1]
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
    low, high = series.get_ylim()
    for label, color, where in _shaded(trajectory, fmu):
        series.fill_between(trajectory.time, low, high, where=where, color=color, linewidth=0, label=label)
    series.set_ylim(low, high)
    lines = [*series.get_legend_handles_labels()[0], *speed.get_legend_handles_labels()[0]]
    labels = [line.get_label() for line in lines]
    series.legend(lines, labels, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, frameon=False)
    phase.set_title(fmu.description.modelName)
    save_figure(figure, path, overwrite=overwrite)


def _velocity(fmu: Fmu) -> str:
    """The state that alone is the rate of the first one; without such a state the second."""
    (rate, *_) = fmu.description.derivatives
    behind = [str(variable.name) for variable in rate.dependencies or ()]
    return behind[0] if len(behind) == 1 and behind[0] in fmu.states else fmu.states[1]


def _shaded(trajectory: Trajectory, fmu: Fmu) -> list[tuple[str, str, NDArray[np.bool_]]]:
    """Label, colour and place of what is shaded, if it occurs: stick last, since it may hide a closed contact."""
    if not fmu.ours:
        return []
    contacts = [name for name in fmu.contacts if f"{name}_state" in trajectory.values]
    closed = [trajectory[f"{name}_state"] != OPEN for name in fmu.impacts if name in contacts]
    sticking = [trajectory[f"{name}_state"] == STICK for name in contacts]
    kinds = (("closed", "0.94", closed), ("stick", "0.85", sticking))
    found = [(label, color, np.any(states, axis=0)) for label, color, states in kinds if states]
    return [(label, color, where) for label, color, where in found if where.any()]


def _label(trajectory: Trajectory, name: str) -> str:
    return f"{name} ({trajectory.units[name]})"
