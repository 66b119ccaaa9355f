"""How branches of equilibria are drawn in given axes, and what they say in words."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.shown import draw, tell
from fmu_models.continuation.equilibrium_branch import EIGENVALUES, EquilibriumBranch, SpecialEquilibrium
from fmu_models.continuation.special.kinds import HOPF, kind_of
from fmu_models.report.branch_views import draw_lines, legend_below, legend_of, lines_of, numbers_text
from fmu_models.report.colours import COLOURS
from fmu_models.report.words import axis_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from fmu_models.base.arrays import Complex


@draw.register(EquilibriumBranch)
def _(branch: EquilibriumBranch, axes: Axes) -> None:
    if branch.of == EIGENVALUES:
        _draw_eigenvalues(branch, axes)
    else:
        _draw_equilibria(branch, axes)


def _draw_equilibria(branch: EquilibriumBranch, axes: Axes) -> None:
    """As branches of motions are, the cycles that leave them in another colour; sets of them as bands."""
    stable = branch.stable[:-1] & branch.stable[1:]
    draw_lines(branch.values, stable, branch.points[None, :, branch.states.index(branch.of)], None, "black", axes)
    band = None
    if branch.intervals is not None:
        band = axes.fill_between(
            branch.values,
            *branch.intervals[:, :, branch.states.index(branch.of)].T,
            color="0.85",
            label="set that sticks",
        )
    marks: dict[str, list[tuple[float, float]]] = {}
    for special in branch.special:
        marks.setdefault(special.kind, []).append((special.value, special.state[branch.of]))
    for cycles in branch.cycles:
        draw_lines(*lines_of(cycles, branch.of), COLOURS[0], axes)
        for special in cycles.special:
            marks.setdefault(special.kind, []).append((special.value, special.state[branch.of]))
    handles = legend_of(marks, axes)
    if band is not None:
        handles.append(band)
    if branch.cycles:
        handles.append(axes.plot([], [], color=COLOURS[0], label="cycles, where they begin")[0])
    axes.autoscale_view()
    axes.set(xlabel=axis_label(branch.over, branch.units), ylabel=axis_label(branch.of, branch.units))
    axes.set_title(branch.model, fontsize="medium")
    legend_below(axes, handles)


def _draw_eigenvalues(branch: EquilibriumBranch, axes: Axes) -> None:
    """Their way in the complex plane: dots along the branch, lines where they are a set, marks where it bifurcates."""
    finite = np.isfinite(branch.eigenvalues)
    axes.plot(
        branch.eigenvalues[finite].real,
        branch.eigenvalues[finite].imag,
        "o",
        color="black",
        markersize=2.5,
        label=f"over {branch.over}",
    )
    labelled: set[str] = set()
    for special in branch.special:
        if special.eigenvalues_after is None:
            at = special.eigenvalues[np.isfinite(special.eigenvalues)]
            colour = COLOURS[5] if special.kind == HOPF else COLOURS[1]
            axes.plot(at.real, at.imag, kind_of(special.kind).mark, color=colour, label=special.kind, zorder=3)
            continue
        path = _path(special)
        lines = axes.plot(path.real, path.imag, color=COLOURS[0], linewidth=1.2)
        lines[0].set_label(f"set at {special.parameter} = {round(special.value, 12) + 0.0:.3g}: {special.kind}")
        for name, shares in special.crossings.items():
            rows = special.path(shares)
            colour = COLOURS[1 + ["imaginary axis", "zero", "double"].index(name)]
            distances = np.abs(rows[:, :, None] - rows[:, None, :] + 1e300 * np.eye(rows.shape[1]))
            marked = rows[(distances.min(axis=2) if name == "double" else np.abs(rows.real)) < 1e-6]
            label = None if name in labelled else name
            axes.plot(marked.real, marked.imag, "o", color=colour, markersize=5, zorder=3, label=label)
            labelled.add(name)
            for share, at in zip(shares, marked[marked.imag >= -1e-6], strict=False):
                above = (4, -11 if name == "double" else 4)
                where = (at.real, at.imag)
                axes.annotate(f"$q$ = {share:.4g}", where, above, textcoords="offset points", fontsize="x-small")
    axes.axhline(0.0, color="0.6", linewidth=0.6, zorder=0)
    axes.axvline(0.0, color="0.6", linewidth=0.6, zorder=0)
    axes.set(xlabel="real part (1/s)", ylabel="imaginary part (1/s)")
    axes.set_title(branch.model, fontsize="medium")
    axes.legend(frameon=False, fontsize="small")


def _path(special: SpecialEquilibrium) -> Complex:
    """(m, n) the set of eigenvalues as n lines."""
    from scipy.optimize import linear_sum_assignment

    crossings = [share for shares in special.crossings.values() for share in shares]
    path = special.path(np.unique([*np.linspace(0.0, 1.0, 401), *crossings]))
    for before, row in pairwise(path):
        row[:] = row[linear_sum_assignment(np.abs(before[:, None] - row))[1]]
    return path


@tell.register(EquilibriumBranch)
def _(branch: EquilibriumBranch) -> str:
    """What is special, in the order of the branch, the ends, and the cycles that leave."""
    (kind, why), last = branch.ends
    lines = [f"{branch._heading()}: {branch.stable.sum()} stable", f"  {kind}: {why}"]
    lines += [f"  {_told_equilibrium(special)}" for special in branch.special]
    for index in (0, -1) if branch.intervals is not None else ():
        lines.append(f"  {_told_set(branch, index)}")
    lines.append(f"  {last[0]}: {last[1]}")
    lines += [f"  {branch.how}"] if branch.how else []
    return "\n".join([*lines, *(tell(cycle) for cycle in branch.cycles)])


def _told_set(branch: EquilibriumBranch, index: int) -> str:
    assert branch.intervals is not None
    ends = (
        ", ".join(f"{n} = {v:.10g}" for n, v in zip(branch.states, end, strict=True)) for end in branch.intervals[index]
    )
    return f"at {branch.over} = {branch.values[index]:.15g} from {' to '.join(ends)}"


def _told_equilibrium(special: SpecialEquilibrium) -> str:
    kind = f"{special.kind}, {special.criticality}" if special.criticality else special.kind
    line = f"{kind} at {special.parameter} = {special.value:.15g}; eigenvalues {numbers_text(special.eigenvalues)}"
    if special.eigenvalues_after is not None:
        line += f"; beyond {numbers_text(special.eigenvalues_after)}"
        line += "; two equilibria meet" if special.turns else ""
    for where, shares in special.crossings.items():
        each = (f"q = {q:.8g} ({numbers_text(row)})" for q, row in zip(shares, special.path(shares), strict=True))
        line += f"; {where} at {', '.join(each)}"
    return line
