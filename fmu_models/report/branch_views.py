"""How branches, their curves and manifolds are drawn in given axes, and what they say in words."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.analyses.branch import Followed
from fmu_models.analyses.homoclinic import Homoclinic
from fmu_models.analyses.manifolds import Manifolds
from fmu_models.base.shown import draw, tell
from fmu_models.continuation.branch import MULTIPLIER, PERIOD, Branch
from fmu_models.continuation.branches import Branches
from fmu_models.continuation.curves.curve import ClosedForm, Curve, Curves
from fmu_models.continuation.special.special import Special
from fmu_models.report.colours import COLOURS

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    Vector = NDArray[Any]

# of what is special on a branch
MARKS = {
    **{"fold": "s", "flip": "D", "Neimark-Sacker": "*", "pitchfork": "P", "branch point": "p", "Hopf": "h"},
    **{"grazing, compliant": "o", "grazing, rigid": "v", "grazing": "o", "grazing-sliding corner": "^", "touch": "<"},
    **{"sliding exchange": ">", "detachment": "o", "tie": "v", "jump": "X", "flip of the parent": "d"},
    **{"discontinuous Hopf": "H", "discontinuous fold": "8", "multiple crossing": "*", "boundary equilibrium": "o"},
    **{"end at a surface": "X"},
}
# of curves of specials, by the number of their kind
DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (8, 2)), (0, (1, 2)), (0, (3, 1)), *["-"] * 8)
SAID, WIDTHS = ("stable", "unstable"), (2.0, 0.7)
KNOWN = 1001  # points of a closed form


@draw.register(Branch)
def _(branch: Branch, axes: Axes) -> None:
    draw_branches((branch,), branch.of, axes)


@draw.register(Branches)
def _(found: Branches, axes: Axes) -> None:
    draw_branches(found.branches, found.of, axes)


def draw_branches(branches: Sequence[Branch], of: str, axes: Axes) -> None:
    """Stable motions by thick lines, unstable ones by thin lines, what is special by marks; where the word changes a
    dotted line between the multipliers on both sides."""
    marks: dict[str, list[tuple[float, float]]] = {}
    for branch in branches:
        draw_lines(*lines_of(branch, of), "black", axes)
        for special in branch.special:
            heights = _heights(special, of, branch.every)
            marks.setdefault(special.kind, []).extend((special.value, height) for height in heights)
            if len(heights) > 1 and of == MULTIPLIER:
                axes.plot([special.value] * 2, heights, ":", color="black", linewidth=1.0)
    handles = legend_of(marks, axes)
    for bound in (-1.0, 1.0) if of == MULTIPLIER else ():
        axes.axhline(bound, color="0.7", linewidth=0.7, zorder=0)
    axes.autoscale_view()
    axes.set_xlabel(with_unit(branches[0].over, branches[0].units))
    said = {MULTIPLIER: "real part of the largest multiplier", PERIOD: "period"}
    axes.set_ylabel(said[of] if of in said else with_unit(of, branches[0].units))
    axes.set_title(branches[0].model, fontsize="medium")
    legend_below(axes, handles)


def draw_lines(values: Vector, stable: Vector, lines: Vector, colour: str, axes: Axes) -> None:
    """Heights (k, m) over values (m,), pieces thick where they are stable (m - 1,)."""
    from matplotlib.collections import LineCollection

    for y in lines:
        points = np.stack([values, y], 1)
        pieces, widths = np.stack([points[:-1], points[1:]], 1), np.where(stable, *WIDTHS)
        axes.add_collection(LineCollection(list(pieces), linewidths=widths, colors=colour, capstyle="round"))


def legend_of(marks: Mapping[str, list[tuple[float, float]]], axes: Axes) -> list[Any]:
    """Lines, and marks by kind, which are drawn where they lie."""
    handles = [
        axes.plot([], [], "-", color="black", linewidth=w, label=name)[0] for name, w in zip(SAID, WIDTHS, strict=True)
    ]
    for place, kind in _in_order(marks):
        (x, y), mark = np.array(marks[kind]).T, MARKS.get(kind, "o")
        colour, size = COLOURS[place % len(COLOURS)], 9 if mark == "*" else 5
        (drawn,) = axes.plot(x, y, mark, color=colour, markeredgecolor="black", markersize=size, label=kind, zorder=4)
        handles.append(drawn)
    return handles


def _in_order(kinds: Iterable[str]) -> list[tuple[int, str]]:
    """Kinds, each with its number among all that are known: the same in every picture."""
    known = list(MARKS)
    return sorted((known.index(kind) if kind in known else len(known), kind) for kind in kinds)


def legend_below(axes: Axes, handles: Sequence[Any]) -> None:
    """Where it hides nothing."""
    columns = 3 if max(len(str(one.get_label())) for one in handles) < 25 else 2
    axes.legend(
        handles=handles, frameon=False, fontsize="small", loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=columns
    )


def lines_of(branch: Branch, of: str) -> tuple[Vector, Vector, Vector]:
    """What a branch is drawn by: values (m,), whether the pieces between are stable (m - 1,), heights (k, m) of each of
    its points; its specials lie among them, but for those where the word changes and with it the multipliers."""
    jumps = of == MULTIPLIER
    if jumps:
        lines = branch.nodes[0].problem.own(branch.multipliers)[None, :, 0].real
    else:
        lines = branch.periods[None] if of == PERIOD else branch.images[:, :, branch.states.index(of)]
    met = [(place, one) for place, one in zip(branch.places, branch.special, strict=True) if not (jumps and one.touch)]
    places, heights = [place for place, _ in met], [_heights(one, of, branch.every) for _, one in met]
    if jumps:
        changed = [i + 1 for i, (one, other) in enumerate(pairwise(branch.words)) if one != other]
        places, heights = [*places, *changed], [*heights, *([np.nan] for _ in changed)]
    known = np.insert(np.ones(len(branch.values), bool), places, False)
    stable = np.insert(branch.stable, places, False)
    values = np.insert(branch.values, places, [*(one.value for _, one in met), *(np.nan for _ in places[len(met) :])])
    if places:
        lines = np.insert(lines, places, np.array(heights).T, axis=1)
    either = (stable[:-1] | ~known[:-1]) & (stable[1:] | ~known[1:]) & (known[:-1] | known[1:])
    return values, either, lines


def _heights(special: Special, of: str, every: int) -> list[float]:
    """Where a special is drawn: at its points, or at the multipliers on both its sides."""
    if of == MULTIPLIER:
        sides = (special.multipliers, special.multipliers_with_event)
        return [float(special.node.problem.own(one)[0].real) for one in sides if one is not None]
    if of == PERIOD:
        return [special.period]
    place = list(special.state).index(of)
    return [float(special.state[of]), *(float(special.at(float(k))[place]) for k in range(1, every))]


def with_unit(name: str, units: Mapping[str, str]) -> str:
    """With its unit."""
    unit = units.get(name, "1")
    return name if unit == "1" else f"{name} ({unit})"


@draw.register(Curve)
def _(curve: Curve, axes: Axes) -> None:
    _draw_curves((curve,), axes)


@draw.register(Curves)
def _(found: Curves, axes: Axes) -> None:
    _draw_curves(found.curves, axes, found.closed_form)


def _draw_curves(curves: Sequence[Curve], axes: Axes, closed_form: ClosedForm | None = None) -> None:
    """A colour and a dash for each kind, a numbered dot where a curve has a point of codimension 2, a broad pale line
    for what is known of them."""
    kinds = [kind for _, kind in _in_order({one.kind for one in curves})]
    said: set[str] = set()
    met: dict[str, list[tuple[float, float]]] = {}
    for curve in curves:
        style = {"color": COLOURS[kinds.index(curve.kind) % len(COLOURS)], "linestyle": DASHES[kinds.index(curve.kind)]}
        label = None if curve.kind in said else curve.kind
        said.add(curve.kind)
        axes.plot(curve.seconds, curve.values, label=label, **style)
        for one in curve.meetings:
            met.setdefault(one.kind, []).append((one.parameters[curve.second], one.parameters[curve.over]))
    if closed_form is not None:
        ends = axes.get_xlim(), axes.get_ylim()
        values = np.linspace(*ends[1], KNOWN)
        known = closed_form.at(curves[0].over, values)
        axes.plot(known, values, color="0.8", linewidth=5.0, zorder=0, label=f"{curves[0].second}: closed form")
        axes.set_xlim(ends[0])
        axes.set_ylim(ends[1])
    for i, (kind, places) in enumerate(met.items(), 1):
        axes.plot(*np.array(places).T, "o", color="black", markersize=4, label=f"{i} {kind}", zorder=4)
        for place in places:
            axes.annotate(str(i), place, fontsize="small", xytext=(4, 4), textcoords="offset points")
    axes.set_xlabel(with_unit(curves[0].second, curves[0].units))
    axes.set_ylabel(with_unit(curves[0].over, curves[0].units))
    axes.set_title(curves[0].model, fontsize="medium")
    legend_below(axes, axes.get_legend_handles_labels()[0])


@tell.register(Curve)
def _(curve: Curve) -> str:
    """Its points of codimension 2, and the ends."""
    (kind, why), last = curve.ends
    lines = [curve._heading(), f"  {kind}: {why}"]
    for met in curve.meetings:
        at = ", ".join(f"{name} = {value:.15g}" for name, value in met.parameters.items())
        lines.append(f"  {met.kind} at {at}; {curve.called} {numbers_text(met.multipliers)}")
    return "\n".join([*lines, f"  {last[0]}: {last[1]}"])


@tell.register(Curves)
def _(found: Curves) -> str:
    form = found.closed_form
    lines = []
    for one in found.curves:
        lines.append(tell(one))
        if form is not None:
            lines.append(f"  from {form.formula.text}: {form.error(one):.2g} at most")
    return "\n".join([*lines, *(f"not followed: {why}" for why in found.failures)])


@tell.register(Branch)
def _(branch: Branch) -> str:
    """What is special, in the order of the branch, and the ends."""
    lines = [f"{branch._heading()}, period {branch.every}: {branch.stable.sum()} stable"]
    (kind, why), last = branch.ends
    lines.append(f"  {kind}: {why}")
    lines += [f"  {_told(special)}" for special in branch.special]
    return "\n".join([*lines, f"  {last[0]}: {last[1]}"])


def _told(special: Special) -> str:
    multipliers = ", ".join(_number(one) for one in special.multipliers)
    kind = f"{special.kind}, {special.criticality}" if special.criticality else special.kind
    line = f"{kind} at {special.parameter} = {special.value:.15g}; multipliers {multipliers}"
    if special.contact:
        line += f"; {special.contact}"
    if special.multipliers_with_event is not None:
        line += f"; with its event {', '.join(_number(one) for one in special.multipliers_with_event)}"
    for where, shares in special.crossings.items():
        line += f"; {where} at q = {', '.join(f'{share:.8g}' for share in shares)}"
    return line


def numbers_text(values: Any) -> str:
    return ", ".join(_number(one) for one in values)


def _number(value: complex) -> str:
    real, imaginary = float(np.real(value)), float(np.imag(value))
    return f"{real:.8g}" if abs(imaginary) < 1e-12 else f"{real:.8g}{imaginary:+.8g}i"


@tell.register(Branches)
def _(found: Branches) -> str:
    return "\n".join(tell(one) for one in found.branches)


@draw.register(Followed)
def _(found: Followed, axes: Axes) -> None:
    draw(found.shown, axes)


@tell.register(Followed)
def _(found: Followed) -> str:
    return tell(found.shown)


@draw.register(Manifolds)
def _(found: Manifolds, axes: Axes) -> None:
    """Unstable ones red, stable ones blue, the saddle a square."""
    columns = [found.states.index(name) for name in found.of]
    said: set[str] = set()
    for one in found.curves:
        x, y = (one.points[:, i] for i in (*columns, *columns)[:2])
        label = None if one.kind in said else one.kind
        axes.plot(x, y, color=COLOURS[5 if one.kind == "unstable" else 0], linewidth=0.8, label=label)
        said.add(one.kind)
    axes.plot(found.saddle[:, columns[0]], found.saddle[:, columns[-1]], "s", color="black", label="saddle")
    axes.set_xlabel(found.of[0])
    axes.set_ylabel(found.of[-1])
    axes.set_title(found.model, fontsize="medium")
    axes.legend(frameon=False, fontsize="small")


@tell.register(Manifolds)
def _(found: Manifolds) -> str:
    """The saddle, its eigenvalues, and each curve with its end."""
    lines = [found._heading()]
    for point in found.saddle:
        lines.append("  saddle " + ", ".join(f"{n} = {v:.15g}" for n, v in zip(found.states, point, strict=True)))
    lines.append(f"  eigenvalues {numbers_text(found.eigenvalues)}")
    lines += [f"  {one.kind} along {one.eigenvalue:.8g}: {len(one.points)} points; {one.end}" for one in found.curves]
    return "\n".join(lines)


@draw.register(Homoclinic)
def _(found: Homoclinic, axes: Axes) -> None:
    """The motion in the plane of the first two states, and its saddle."""
    y = min(1, len(found.states) - 1)
    axes.plot(found.points[:, 0], found.points[:, y], color="black", linewidth=1.2, label="homoclinic motion")
    axes.plot(found.saddle[0], found.saddle[y], "s", color="black", label="saddle")
    axes.set_xlabel(found.states[0])
    axes.set_ylabel(found.states[y])
    axes.set_title(f"{found.model}, {found.parameter} = {found.value:.9g}", fontsize="medium")
    axes.legend(frameon=False, fontsize="small")


@tell.register(Homoclinic)
def _(found: Homoclinic) -> str:
    born = "a stable" if found.saddle_quantity < 0.0 else "an unstable"
    at = ", ".join(f"{name} = {value:.15g}" for name, value in zip(found.states, found.saddle, strict=True))
    return "\n".join(
        [
            found._heading(),
            f"  saddle {at}; eigenvalues {numbers_text(found.eigenvalues)}",
            f"  {born} cycle is born there; known to {found.width:.2g}",
        ]
    )
