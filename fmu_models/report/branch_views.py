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
from fmu_models.continuation.special.kinds import KINDS, kind_of
from fmu_models.continuation.special.special import Special
from fmu_models.report.colours import COLOURS
from fmu_models.report.words import axis_label

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D
    from numpy.typing import NDArray

    Vector = NDArray[Any]

# of curves of specials, by the number of their kind
DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (8, 2)), (0, (1, 2)), (0, (3, 1)), *["-"] * 8)
SAID, STYLES = ("stable", "unstable"), (("-", 1.6), ((0, (4, 2)), 0.9))  # dashes and widths
KNOWN = 1001  # points of a closed form
# of the picture, what a straight piece may be off a branch: half a pixel; pieces into which it is cut then; of its
# length, what a spline may be off it
STRAIGHT, BETWEEN, SWING = 5e-4, 8, 0.3


@draw.register(Branch)
def _(branch: Branch, axes: Axes) -> None:
    draw_branches((branch,), branch.of, axes)


@draw.register(Branches)
def _(result: Branches, axes: Axes) -> None:
    draw_branches(result.branches, result.of, axes, result.closed_form)


def draw_branches(branches: Sequence[Branch], of: str, axes: Axes, closed_form: ClosedForm | None = None) -> None:
    """Stable motions by lines, unstable ones by dashes, what is special by marks, below them what is known of them;
    where the word changes a dotted line between the multipliers on both sides."""
    marks: dict[str, list[tuple[float, float]]] = {}
    for branch in branches:
        draw_lines(*lines_of(branch, of), "black", axes)
        for i, special in enumerate(branch.special):
            heights = _heights(branch, i, of)
            marks.setdefault(special.kind, []).extend((special.value, height) for height in heights)
            if len(heights) > 1 and of == MULTIPLIER:
                axes.plot([special.value] * 2, heights, ":", color="black", linewidth=1.0)
    handles = legend_of(marks, axes)
    for bound in (-1.0, 1.0) if of == MULTIPLIER else ():
        axes.axhline(bound, color="0.7", linewidth=0.7, zorder=0)
    axes.autoscale_view()
    if closed_form is not None:
        handles.append(_draw_closed_form(closed_form, branches[0].over, of, axes, axes.get_xlim(), swapped=False))
    axes.set_xlabel(axis_label(branches[0].over, branches[0].units))
    axes.set_ylabel(_label(branches[0], of))
    axes.set_title(branches[0].model, fontsize="medium")
    legend_below(axes, handles)


def _label(branch: Branch, of: str) -> str:
    if branch.amount is not None and of in branch.measured:
        return axis_label(branch.amount.label, branch.units)
    words = {MULTIPLIER: "real part of the largest multiplier", PERIOD: "period"}
    return words.get(of) or axis_label(of, branch.units)


def _draw_closed_form(
    form: ClosedForm, over: str, shown: str, axes: Axes, ends: tuple[float, float], *, swapped: bool
) -> Line2D:
    """A broad pale line below all others, over a range of the parameter, which is the upright axis if ``swapped``."""
    limits = axes.get_xlim(), axes.get_ylim()
    values = np.linspace(*ends, KNOWN)
    points = (form.at(over, values), values) if swapped else (values, form.at(over, values))
    (line,) = axes.plot(*points, color="0.8", linewidth=5.0, zorder=0, label=f"{shown}: closed form")
    axes.set(xlim=limits[0], ylim=limits[1])
    return line


def draw_lines(values: Vector, stable: Vector, lines: Vector, corners: Vector | None, colour: str, axes: Axes) -> None:
    """Heights (k, m) over values (m,), dashed where pieces (m - 1,) are not stable; smooth but at corners (m,), if it
    is known where these are."""
    from matplotlib.collections import LineCollection

    for y in lines:
        points, solid = np.stack([values, y], 1), stable
        if corners is not None:
            points, solid = smoothed(points, stable, corners)
        edges = [0, *(np.flatnonzero(np.diff(solid)) + 1).tolist(), len(solid)]
        styles = [STYLES[0 if solid[first] else 1] for first, _ in pairwise(edges)]
        pieces = [points[first : last + 1] for first, last in pairwise(edges)]
        axes.add_collection(
            LineCollection(pieces, linewidths=[w for _, w in styles], linestyles=[d for d, _ in styles], colors=colour)
        )


def smoothed(points: Vector, stable: Vector, corners: Vector) -> tuple[Vector, Vector]:
    """A line through points (m, 2) with points between, where straight pieces would be seen as such.

    Between corners (m,) these are on cubic splines over the length in the picture, unless one swings out.
    """
    from scipy.interpolate import CubicSpline

    with np.errstate(invalid="ignore"):
        size = np.nanmax(points, axis=0) - np.nanmin(points, axis=0)
    size[~(size > 0.0)] = 1.0
    missing = ~np.isfinite(points).all(axis=1)
    ends = corners | missing | np.roll(missing, 1) | np.roll(missing, -1)
    ends[[0, -1]] = True
    drawn, solid = [points[:1]], [stable[:0]]
    for first, last in pairwise(np.flatnonzero(ends).tolist()):
        piece, kept = points[first : last + 1], stable[first:last]
        steps = np.hypot(*(np.diff(piece, axis=0) / size).T)
        if len(piece) > 2 and (steps > 0.0).all():
            length = np.append(0.0, np.cumsum(steps))
            curve = CubicSpline(length, piece)
            bow = np.abs((curve(length[:-1] + 0.5 * steps) - 0.5 * (piece[:-1] + piece[1:])) / size).max(axis=1)
            if bow.max() > STRAIGHT and (bow < SWING * steps).all():
                places = length[:-1, None] + steps[:, None] * np.arange(BETWEEN) / BETWEEN
                fine = curve(np.append(places, length[-1]))
                fine[::BETWEEN] = piece
                piece, kept = fine, np.repeat(kept, BETWEEN)
        drawn.append(piece[1:])
        solid.append(kept)
    return np.concatenate(drawn), np.concatenate(solid)


def legend_of(marks: Mapping[str, list[tuple[float, float]]], axes: Axes) -> list[Any]:
    """Lines, and marks by kind, which are drawn where they lie."""
    handles = [
        axes.plot([], [], linestyle=dash, color="black", linewidth=width, label=name)[0]
        for name, (dash, width) in zip(SAID, STYLES, strict=True)
    ]
    for index, kind in _in_order(marks):
        (x, y), mark = np.array(marks[kind]).T, kind_of(kind).mark
        colour, size = COLOURS[index % len(COLOURS)], 9 if mark == "*" else 5
        (drawn,) = axes.plot(x, y, mark, color=colour, markeredgecolor="black", markersize=size, label=kind, zorder=4)
        handles.append(drawn)
    return handles


def _in_order(kinds: Iterable[str]) -> list[tuple[int, str]]:
    """Kinds, each with its number among all that are known: the same in every picture."""
    order = list(KINDS)
    return sorted((order.index(kind) if kind in order else len(order), kind) for kind in kinds)


def legend_below(axes: Axes, handles: Sequence[Any], columns: int = 0) -> None:
    """Where it hides nothing: under the label of the axis, which is there already."""
    from matplotlib.transforms import ScaledTranslation

    longest = max(len(str(handle.get_label())) for handle in handles)
    figure: Any = axes.get_figure(root=True)
    under = ScaledTranslation(0.0, -(28.0 + 13.0 * len(axes.get_xlabel().splitlines())) / 72.0, figure.dpi_scale_trans)
    axes.legend(
        **{"handles": handles, "frameon": False, "fontsize": "small", "loc": "upper center", "borderaxespad": 0.0},
        **{"bbox_to_anchor": (0.5, 0.0), "bbox_transform": axes.transAxes + under},
        ncols=columns or (3 if longest < 25 else 2),
    )


def lines_of(branch: Branch, of: str) -> tuple[Vector, Vector, Vector, Vector]:
    """What a branch is drawn by: values (m,), whether the pieces between are stable (m - 1,), heights (k, m) of each of
    its points, where it may have corners (m,). Its specials lie among them, but for those where the word changes and
    with it the multipliers."""
    jumps = of == MULTIPLIER
    if jumps:
        lines = branch.nodes[0].problem.own(branch.multipliers)[None, :, 0].real
    elif of in branch.measured:
        lines = branch.amounts[None, :, branch.measured.index(of)]
    else:
        lines = branch.periods[None] if of == PERIOD else branch.images[:, :, branch.states.index(of)]
    marked = [
        (index, special, _heights(branch, i, of))
        for i, (index, special) in enumerate(zip(branch.places, branch.special, strict=True))
        if not (jumps and special.touch)
    ]
    places, heights = [index for index, *_ in marked], [height for *_, height in marked]
    if jumps:
        changed = [i + 1 for i, (word, next_word) in enumerate(pairwise(branch.words)) if word != next_word]
        places, heights = [*places, *changed], [*heights, *([np.nan] for _ in changed)]
    regular = np.insert(np.ones(len(branch.values), bool), places, False)
    touched = [bool(special.touch or special.collision) for _, special, _ in marked]
    corners = np.insert(
        np.zeros(len(branch.values), bool), places, [*touched, *([True] * (len(places) - len(touched)))]
    )
    stable = np.insert(branch.stable, places, False)
    values = np.insert(
        branch.values, places, [*(special.value for _, special, _ in marked), *(np.nan for _ in places[len(marked) :])]
    )
    if places:
        lines = np.insert(lines, places, np.array(heights).T, axis=1)
    either = (stable[:-1] | ~regular[:-1]) & (stable[1:] | ~regular[1:]) & (regular[:-1] | regular[1:])
    return values, either, lines, corners


def _heights(branch: Branch, index: int, of: str) -> list[float]:
    """Where a special is drawn: at its points, or at the multipliers on both its sides."""
    special = branch.special[index]
    if of in branch.measured:
        return [float(branch.special_amounts[index])]
    if of == MULTIPLIER:
        sides = (special.multipliers, special.multipliers_with_event)
        return [float(special.node.problem.own(side)[0].real) for side in sides if side is not None]
    if of == PERIOD:
        return [special.period]
    index = list(special.state).index(of)
    return [float(special.state[of]), *(float(special.at(float(k))[index]) for k in range(1, branch.every))]


@draw.register(Curve)
def _(curve: Curve, axes: Axes) -> None:
    _draw_curves((curve,), axes)


@draw.register(Curves)
def _(result: Curves, axes: Axes) -> None:
    _draw_curves(result.curves, axes, result.closed_form)


def _draw_curves(curves: Sequence[Curve], axes: Axes, closed_form: ClosedForm | None = None) -> None:
    """A colour and a dash for each kind, a numbered dot where a curve has a point of codimension 2, a broad pale line
    for what is known of them."""
    kinds = [kind for _, kind in _in_order({curve.kind for curve in curves})]
    labelled: set[str] = set()
    points: dict[str, list[tuple[float, float]]] = {}
    for curve in curves:
        style = {"color": COLOURS[kinds.index(curve.kind) % len(COLOURS)], "linestyle": DASHES[kinds.index(curve.kind)]}
        label = None if curve.kind in labelled else curve.kind
        labelled.add(curve.kind)
        axes.plot(curve.seconds, curve.values, label=label, **style)
        for meeting in curve.meetings:
            points.setdefault(meeting.kind, []).append(
                (meeting.parameters[curve.second], meeting.parameters[curve.over])
            )
    if closed_form is not None:
        _draw_closed_form(closed_form, curves[0].over, curves[0].second, axes, axes.get_ylim(), swapped=True)
    for i, (kind, places) in enumerate(points.items(), 1):
        axes.plot(*np.array(places).T, "o", color="black", markersize=4, label=f"{i} {kind}", zorder=4)
        for point in places:
            axes.annotate(str(i), point, fontsize="small", xytext=(4, 4), textcoords="offset points")
    axes.set(xlabel=axis_label(curves[0].second, curves[0].units), ylabel=axis_label(curves[0].over, curves[0].units))
    axes.set_title(curves[0].model, fontsize="medium")
    legend_below(axes, axes.get_legend_handles_labels()[0])


@tell.register(Curve)
def _(curve: Curve) -> str:
    """Its points of codimension 2, and the ends."""
    (kind, why), last = curve.ends
    lines = [curve._heading(), f"  {kind}: {why}"]
    for meeting in curve.meetings:
        at = ", ".join(f"{name} = {value:.15g}" for name, value in meeting.parameters.items())
        lines.append(f"  {meeting.kind} at {at}; {curve.called} {numbers_text(meeting.multipliers)}")
    return "\n".join([*lines, f"  {last[0]}: {last[1]}"])


@tell.register(Curves)
def _(result: Curves) -> str:
    form = result.closed_form
    lines = []
    for curve in result.curves:
        lines.append(tell(curve))
        if form is not None:
            lines.append(f"  from {form.formula.text}: {form.error(curve):.2g} at most")
    return "\n".join([*lines, *(f"not followed: {why}" for why in result.failures)])


@tell.register(Branch)
def _(branch: Branch) -> str:
    """What is special, in the order of the branch, and the ends."""
    turns = "turns" if branch.of == PERIOD else "period"
    lines = [f"{branch._heading()}, {turns} {branch.every}: {branch.stable.sum()} stable"]
    (kind, why), last = branch.ends
    lines.append(f"  {kind}: {why}")
    lines += [f"  {_told(special)}" for special in branch.special]
    return "\n".join([*lines, f"  {last[0]}: {last[1]}"])


def _told(special: Special) -> str:
    multipliers = ", ".join(_number(multiplier) for multiplier in special.multipliers)
    symmetry = "symmetry-breaking " if special.breaks_symmetry else ""
    kind = symmetry + (f"{special.kind}, {special.criticality}" if special.criticality else special.kind)
    line = f"{kind} at {special.parameter} = {special.value:.15g}; multipliers {multipliers}"
    if special.contact:
        line += f"; {special.contact}"
    if special.multipliers_with_event is not None:
        line += f"; with its event {', '.join(_number(value) for value in special.multipliers_with_event)}"
    for where, shares in special.crossings.items():
        line += f"; {where} at q = {', '.join(f'{share:.8g}' for share in shares)}"
    return line


def numbers_text(values: Iterable[complex]) -> str:
    return ", ".join(_number(value) for value in values)


def _number(value: complex) -> str:
    real, imaginary = float(np.real(value)), float(np.imag(value))
    return f"{real:.8g}" if abs(imaginary) < 1e-12 else f"{real:.8g}{imaginary:+.8g}i"


@tell.register(Branches)
def _(result: Branches) -> str:
    return "\n".join(tell(branch) for branch in result.branches)


@draw.register(Followed)
def _(result: Followed, axes: Axes) -> None:
    draw(result.shown, axes)


@tell.register(Followed)
def _(result: Followed) -> str:
    return tell(result.shown)


@draw.register(Manifolds)
def _(result: Manifolds, axes: Axes) -> None:
    """Unstable ones red, stable ones blue, the saddle a square."""
    columns = [result.states.index(name) for name in result.of]
    labelled: set[str] = set()
    for curve in result.curves:
        x, y = (curve.points[:, i] for i in (*columns, *columns)[:2])
        label = None if curve.kind in labelled else curve.kind
        axes.plot(x, y, color=COLOURS[5 if curve.kind == "unstable" else 0], linewidth=0.8, label=label)
        labelled.add(curve.kind)
    axes.plot(result.saddle[:, columns[0]], result.saddle[:, columns[-1]], "s", color="black", label="saddle")
    axes.set(xlabel=result.of[0], ylabel=result.of[-1])
    axes.set_title(result.model, fontsize="medium")
    axes.legend(frameon=False, fontsize="small")


@tell.register(Manifolds)
def _(result: Manifolds) -> str:
    """The saddle, its eigenvalues, and each curve with its end."""
    lines = [result._heading()]
    for point in result.saddle:
        lines.append("  saddle " + ", ".join(f"{n} = {v:.15g}" for n, v in zip(result.states, point, strict=True)))
    lines.append(f"  eigenvalues {numbers_text(result.eigenvalues)}")
    lines += [
        f"  {curve.kind} along {curve.eigenvalue:.8g}: {len(curve.points)} points; {curve.end}"
        for curve in result.curves
    ]
    return "\n".join(lines)


@draw.register(Homoclinic)
def _(result: Homoclinic, axes: Axes) -> None:
    """The motion in the plane of the first two states, and its saddle."""
    y = min(1, len(result.states) - 1)
    axes.plot(result.points[:, 0], result.points[:, y], color="black", linewidth=1.2, label="homoclinic motion")
    axes.plot(result.saddle[0], result.saddle[y], "s", color="black", label="saddle")
    axes.set(xlabel=result.states[0], ylabel=result.states[y])
    axes.set_title(f"{result.model}, {result.parameter} = {result.value:.9g}", fontsize="medium")
    axes.legend(frameon=False, fontsize="small")


@tell.register(Homoclinic)
def _(result: Homoclinic) -> str:
    at = ", ".join(f"{name} = {value:.15g}" for name, value in zip(result.states, result.saddle, strict=True))
    return "\n".join(
        [
            result._heading(),
            f"  saddle {at}; eigenvalues {numbers_text(result.eigenvalues)}",
            f"  {result.born} is born there; known to {result.width:.2g}",
        ]
    )
