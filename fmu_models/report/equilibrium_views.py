"""How branches of equilibria are drawn in given axes, and what they say in words."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.shown import draw, tell
from fmu_models.continuation.equilibrium_branch import EIGENVALUES, EquilibriumBranch, SpecialEquilibrium
from fmu_models.report.branch_views import (
    MARKS,
    draw_lines,
    legend_below,
    legend_of,
    lines_of,
    numbers_text,
    with_unit,
)
from fmu_models.report.colours import COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@draw.register(EquilibriumBranch)
def _(found: EquilibriumBranch, axes: Axes) -> None:
    if found.of == EIGENVALUES:
        _draw_eigenvalues(found, axes)
    else:
        _draw_equilibria(found, axes)


def _draw_equilibria(found: EquilibriumBranch, axes: Axes) -> None:
    """As branches of motions are, the cycles that leave them in another colour; sets of them as bands."""
    stable = found.stable[:-1] & found.stable[1:]
    draw_lines(found.values, stable, found.points[None, :, found.states.index(found.of)], "black", axes)
    band = None
    if found.intervals is not None:
        band = axes.fill_between(
            found.values, *found.intervals[:, :, found.states.index(found.of)].T, color="0.85", label="set that sticks"
        )
    marks: dict[str, list[tuple[float, float]]] = {}
    for special in found.special:
        marks.setdefault(special.kind, []).append((special.value, special.state[found.of]))
    for cycles in found.cycles:
        draw_lines(*lines_of(cycles, found.of), COLOURS[0], axes)
        for special in cycles.special:
            marks.setdefault(special.kind, []).append((special.value, special.state[found.of]))
    handles = legend_of(marks, axes)
    if band is not None:
        handles.append(band)
    if found.cycles:
        handles.append(axes.plot([], [], color=COLOURS[0], label="cycles, where they begin")[0])
    axes.autoscale_view()
    axes.set_xlabel(with_unit(found.over, found.units))
    axes.set_ylabel(with_unit(found.of, found.units))
    axes.set_title(found.model, fontsize="medium")
    legend_below(axes, handles)


def _draw_eigenvalues(found: EquilibriumBranch, axes: Axes) -> None:
    """Their way in the complex plane: dots along the branch, lines where they are a set, marks where it bifurcates."""
    finite = np.isfinite(found.eigenvalues)
    axes.plot(
        found.eigenvalues[finite].real,
        found.eigenvalues[finite].imag,
        "o",
        color="black",
        markersize=2.5,
        label=f"over {found.over}",
    )
    said: set[str] = set()
    for special in found.special:
        if special.eigenvalues_after is None:
            at = special.eigenvalues[np.isfinite(special.eigenvalues)]
            colour = COLOURS[5] if special.kind == "Hopf" else COLOURS[1]
            axes.plot(at.real, at.imag, MARKS.get(special.kind, "o"), color=colour, label=special.kind, zorder=3)
            continue
        path = _path(special)
        lines = axes.plot(path.real, path.imag, color=COLOURS[0], linewidth=1.2)
        lines[0].set_label(f"set at {special.parameter} = {round(special.value, 12) + 0.0:.3g}: {special.kind}")
        for name, shares in special.crossings.items():
            rows = special.path(shares)
            colour = COLOURS[1 + ["imaginary axis", "zero", "double"].index(name)]
            apart = np.abs(rows[:, :, None] - rows[:, None, :] + 1e300 * np.eye(rows.shape[1]))
            kept = rows[(apart.min(axis=2) if name == "double" else np.abs(rows.real)) < 1e-6]
            label = None if name in said else name
            axes.plot(kept.real, kept.imag, "o", color=colour, markersize=5, zorder=3, label=label)
            said.add(name)
            for share, at in zip(shares, kept[kept.imag >= -1e-6], strict=False):
                above = (4, -11 if name == "double" else 4)
                where = (at.real, at.imag)
                axes.annotate(f"$q$ = {share:.4g}", where, above, textcoords="offset points", fontsize="x-small")
    axes.axhline(0.0, color="0.6", linewidth=0.6, zorder=0)
    axes.axvline(0.0, color="0.6", linewidth=0.6, zorder=0)
    axes.set_xlabel("real part (1/s)")
    axes.set_ylabel("imaginary part (1/s)")
    axes.set_title(found.model, fontsize="medium")
    axes.legend(frameon=False, fontsize="small")


def _path(special: SpecialEquilibrium) -> Any:
    """(m, n) the set of eigenvalues as n lines."""
    from scipy.optimize import linear_sum_assignment

    met = [share for shares in special.crossings.values() for share in shares]
    path = special.path(np.unique([*np.linspace(0.0, 1.0, 401), *met]))
    for before, row in pairwise(path):
        row[:] = row[linear_sum_assignment(np.abs(before[:, None] - row))[1]]
    return path


@tell.register(EquilibriumBranch)
def _(found: EquilibriumBranch) -> str:
    """What is special, in the order of the branch, the ends, and the cycles that leave."""
    (kind, why), last = found.ends
    lines = [f"{found._heading()}: {found.stable.sum()} stable", f"  {kind}: {why}"]
    lines += [f"  {_told_equilibrium(one)}" for one in found.special]
    for place in (0, -1) if found.intervals is not None else ():
        lines.append(f"  {_told_set(found, place)}")
    lines.append(f"  {last[0]}: {last[1]}")
    lines += [f"  {found.how}"] if found.how else []
    return "\n".join([*lines, *(tell(one) for one in found.cycles)])


def _told_set(found: EquilibriumBranch, place: int) -> str:
    assert found.intervals is not None
    ends = (
        ", ".join(f"{n} = {v:.10g}" for n, v in zip(found.states, end, strict=True)) for end in found.intervals[place]
    )
    return f"at {found.over} = {found.values[place]:.15g} from {' to '.join(ends)}"


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
