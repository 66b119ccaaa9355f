"""Figures of the fit of a machine: efforts in time, measured and modelled; friction against speed; runs beside logs.

matplotlib is imported only here, inside the functions.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np

from identification.machines.predicted import Predicted, fitted_efforts, friction_curves
from identification.report.slip_report import BLUE, RED

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fmu_models.language.mechanism import Mechanism
    from identification.machines.machine_fit import MachineFit
    from identification.model_check.machine_runs import MachineRun

ONE_COLUMN = 3  # joints; more stand in two
APART = 0.03  # of the whole time, between logs
NAMED = 4  # logs whose names find room side by side
MARKS = 4000  # more marks hide each other


def machine_fit_figure(
    mechanism: Mechanism, fit: MachineFit, seen: Sequence[Predicted], held_out: Sequence[Predicted] = ()
) -> Figure:
    """For each joint its effort with the model, the residual below, logs one after another, held-out ones shaded; for
    few joints beside it friction (effort less the rest) against speed."""
    from matplotlib.figure import Figure

    count = len(fit.joints)
    columns = 1 if count <= ONE_COLUMN else 2
    rows = -(-count // columns)
    figure = Figure(
        figsize=(11.0 if columns == 1 else 15.0, 1.0 + (4.5 if count == 1 else 3.0 * rows)), layout="constrained"
    )
    beside = columns == 1 and bool(seen)
    ratios = (1.5, 1) if beside else (1,) * columns
    grid = figure.add_gridspec(2 * rows, len(ratios), height_ratios=(2.2, 1) * rows, width_ratios=ratios)
    pieces = [*seen, *held_out]
    begins, ends = _places(pieces)
    above = None
    for place, score in enumerate(fit.joints):
        row, column = 2 * (place % rows), place // rows
        above = figure.add_subplot(grid[row, column], sharex=above)
        below = figure.add_subplot(grid[row + 1, column], sharex=above)
        time, measured, modelled = _draw_both(above, pieces, place)
        below.plot(time, measured - modelled, color=RED, linewidth=0.8)
        below.axhline(0.0, color="black", linewidth=0.8)
        above.set_ylabel(f"effort ({score.unit})")
        below.set_ylabel(f"residual ({score.unit})")
        worst = max((one.relative_error for one in score.held_out.values()), default=None)
        off = f", held out {100 * worst:.3g} %" if worst is not None else ""
        error = f"{100 * score.seen.relative_error:.3g} % of the effort"
        above.set_title(f"{score.joint}: error {error}{off}", fontsize="medium")
        above.tick_params(labelbottom=False)
        if place % rows == rows - 1 or place == count - 1:
            below.set_xlabel(_time(pieces))
        for axes in (above, below):
            _mark(axes, begins[len(seen) :], ends[len(seen) :])
    if above is not None:
        figure.legend(
            *above.get_legend_handles_labels(), loc="outside lower left", ncols=3, fontsize="small", frameon=False
        )
    if beside:
        for place in range(count):
            draw_friction(mechanism, fit, seen, place, figure.add_subplot(grid[2 * place : 2 * place + 2, 1]))
    names = [name for name, _ in groupby(piece.log for piece in pieces)]
    logs = ", ".join(names) if len(names) <= NAMED else f"{len(names)} logs"
    figure.suptitle(f"{fit.title}, by {fit.method}: {logs}")
    return figure


def draw_effort(fit: MachineFit, axes: Axes, pieces: Sequence[Predicted] = ()) -> None:
    """Effort in time of the joint that is predicted worst, measured and of the model. pieces: of logs; those that the
    fit has kept if there are none."""
    place = max(range(len(fit.joints)), key=lambda joint: fit.joints[joint].seen.relative_error)
    pieces = pieces or fitted_efforts(fit)
    _draw_both(axes, pieces, place)
    axes.set(xlabel=_time(pieces), ylabel=f"effort of {fit.joints[place].joint} ({fit.joints[place].unit})")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, fontsize="small", frameon=False)


def _draw_both(axes: Axes, pieces: Sequence[Predicted], place: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Effort of a joint, measured and of the model, pieces one after another: time, s, and both, (n,) each."""
    begins, _ = _places(pieces)
    time = _joined([piece.time - piece.time[0] + begin for piece, begin in zip(pieces, begins, strict=True)])
    measured = _joined([piece.measured[:, place] for piece in pieces])
    modelled = _joined([piece.modelled[:, place] for piece in pieces])
    axes.plot(time, measured, color=BLUE, linewidth=1.6, label="measured")
    axes.plot(time, modelled, color="black", linewidth=0.9, linestyle="--", label="model")
    return time, measured, modelled


def _time(parts: Sequence[object]) -> str:
    """What stands below times of logs or pieces of them."""
    return "time, logs one after another (s)" if len(parts) > 1 else "time (s)"


def draw_friction(mechanism: Mechanism, fit: MachineFit, seen: Sequence[Predicted], place: int, axes: Axes) -> None:
    """Friction of a joint against its speed: effort less what is modelled but friction, and the model."""
    speed = np.concatenate([piece.velocity for piece in seen])
    friction = np.concatenate([piece.measured - piece.modelled + piece.friction for piece in seen])
    line = np.linspace(speed.min(axis=0), speed.max(axis=0), 801)
    curve = friction_curves(mechanism, fit, line)
    every, v = max(len(speed) // MARKS, 1), mechanism.coordinates[place].v
    axes.plot(speed[::every, place], friction[::every, place], ".", color=BLUE, markersize=2, alpha=0.5)
    axes.plot(line[:, place], curve[:, place], color="black", linewidth=1.6)
    axes.set(xlabel=f"{v.name} ({v.unit})", ylabel=f"friction: effort less the rest ({fit.joints[place].unit})")
    axes.grid(alpha=0.25)


def machine_runs_figure(fit: MachineFit, runs: Sequence[MachineRun]) -> Figure:
    """For each joint its position, measured and run by the engine; logs one after another."""
    from matplotlib.figure import Figure

    count = len(fit.joints)
    columns = 1 if count <= ONE_COLUMN else 2
    rows = -(-count // columns)
    figure = Figure(figsize=(11.0 if columns == 1 else 15.0, 1.0 + 2.2 * rows), layout="constrained")
    begins, end = [], 0.0
    for run in runs:
        begins.append(end - float(run.time[0]))
        end = (1 + APART) * (float(run.time[-1]) + begins[-1])
    time = _joined([run.time + begin for run, begin in zip(runs, begins, strict=True)])
    above = None
    for place, score in enumerate(runs[0].joints):
        above = figure.add_subplot(rows, columns, place + 1, sharex=above)
        above.plot(time, _joined([run.measured[:, place] for run in runs]), color=BLUE, linewidth=1.6, label="measured")
        simulated = []
        for run in runs:
            simulated.append(run.simulated[:, place].copy())
            simulated[-1][run.ends] = np.nan  # a gap at the end of each window
        above.plot(time, _joined(simulated), color="black", linewidth=0.9, linestyle="--", label="simulated")
        above.set_ylabel(f"{score.joint} ({score.unit})")
        above.grid(alpha=0.25)
        if place >= count - columns:
            above.set_xlabel(_time(runs))
    if above is not None:
        figure.legend(
            *above.get_legend_handles_labels(), loc="outside lower left", ncols=2, fontsize="small", frameon=False
        )
    figure.suptitle(f"{fit.title}: begun anew every {runs[0].window:g} s from the measured state")
    return figure


def _places(pieces: Sequence[Predicted]) -> tuple[list[float], list[float]]:
    """Where pieces begin and end, one after another, s: pieces of a log as far apart as they are in it."""
    lengths = [float(piece.time[-1] - piece.time[0]) for piece in pieces]
    begins: list[float] = []
    for place, piece in enumerate(pieces):
        before = pieces[place - 1] if place else None
        if before is None:
            begins.append(0.0)
        elif before.log == piece.log and piece.time[0] > before.time[-1]:
            begins.append(begins[-1] + float(piece.time[0] - before.time[0]))
        else:
            begins.append(begins[-1] + lengths[place - 1] + APART * sum(lengths))
    return begins, [begin + length for begin, length in zip(begins, lengths, strict=True)]


def _joined(parts: Sequence[np.ndarray]) -> np.ndarray:
    """One after another (n,), with a gap that no line crosses."""
    return np.concatenate([np.append(part, np.nan) for part in parts])


def _mark(axes: Axes, begins: Sequence[float], ends: Sequence[float]) -> None:
    """Shade what was held out."""
    for number, (begin, end) in enumerate(zip(begins, ends, strict=True)):
        axes.axvspan(begin, end, color="0.9", linewidth=0, zorder=0, label="" if number else "held out")
    axes.grid(alpha=0.25)
