"""A family of drive speeds in one grid, as in figure 8 of the disc_rig paper: portraits, sticks, bifurcations.

Measured: broad and grey; model: thin, black and dashed, with rings. Nothing is told by colour alone. matplotlib is
imported only here, inside the functions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.model_check.bifurcations import COVER
from identification.model_check.portraits import PHASES, Portrait, Rest
from identification.model_check.table import measured_speed, speed_within
from rig_io.logs.log import stretches

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from identification.model_check.bifurcations import BifurcationComparison
    from identification.model_check.families import FamilyComparison
    from identification.model_check.portraits import PortraitComparison

MEASURED: dict[str, Any] = {"color": "#999999", "linewidth": 4.0}
MODEL: dict[str, Any] = {
    "color": "black",
    "linewidth": 1.3,
    "linestyle": "--",
    "marker": "o",
    "markersize": 4,
    "markerfacecolor": "white",
    "markevery": 20,
}
REST: dict[str, Any] = {"marker": "+", "markersize": 12, "color": "black", "markeredgewidth": 1.3, "linestyle": "none"}
MEASURED_REST: dict[str, Any] = {"marker": "o", "markersize": 13, "color": MEASURED["color"], "linestyle": "none"}
BAR: dict[str, Any] = {"facecolor": "white", "edgecolor": "black", "hatch": "////", "linewidth": 0.8}
COLUMNS = 3
FEW = 4  # portraits in one plane that are all named
MARKS = ("o", "s", "^")


def family_figure(family: FamilyComparison) -> Figure:
    """Portraits at each drive speed with the sticks below them, and at the bottom the share of stick over the speed."""
    from matplotlib.figure import Figure

    members = family.members
    contacts = tuple(members[0].drive_speeds)
    columns = min(max(len(members), 2), COLUMNS)
    rows = -(-len(members) // columns)
    strip = 0.26 + 0.34 * len(contacts)
    figure = Figure(figsize=(0.6 + 2.8 * columns, rows * (3.5 + strip) + 3.0), layout="constrained")
    heights = [*([3.0, strip] * rows), 2.6]
    grid = figure.add_gridspec(2 * rows + 1, columns, height_ratios=heights)
    first: Axes | None = None
    for number, one in enumerate(members):
        row, column = divmod(number, columns)
        axes = figure.add_subplot(grid[2 * row, column], sharex=first, sharey=first)
        first = first or axes
        draw_portrait(one, axes, labelled=column == 0)
        _strip(figure.add_subplot(grid[2 * row + 1, column]), one, contacts, labelled=column == 0)
    draw_diagram(family, figure.add_subplot(grid[2 * rows, :]))
    figure.legend(handles=_key(members), loc="outside upper center", ncols=3, fontsize="small", frameon=False)
    return figure


def _key(members: Sequence[PortraitComparison]) -> list[Any]:
    """What the lines, points and bars mean that are drawn."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    models = [member.model for member in members]
    sticks = [stick for model in models if isinstance(model, Portrait) for stick in model.sticks.values()]
    measured = [member.measured for member in members]
    shown: list[Any] = []
    if any(isinstance(motion, Portrait) for motion in measured):
        shown.append(Line2D([], [], label="measured", **MEASURED))
    if any(isinstance(motion, Rest) for motion in measured):
        shown.append(Line2D([], [], label="steady sliding, measured", **MEASURED_REST))
    if any(isinstance(model, Portrait) for model in models):
        shown.append(Line2D([], [], label="model", **MODEL))
    if any(isinstance(model, Rest) for model in models):
        shown.append(Line2D([], [], label="steady sliding of the model", **REST))
    if any((stick.strip > 0.5).any() for stick in sticks):
        shown.append(Patch(label="stick of the model by its slip speed, as measured", **BAR))
    if any(stick.held is not None and (stick.held > 0.5).any() for stick in sticks):
        shown.append(Line2D([], [], color="black", linewidth=3, label="stick by its contact states"))
    return shown


def draw_family(family: FamilyComparison, axes: Axes) -> None:
    """The portraits of all drive speeds in one plane, each named at its lowest point; of many the first and last."""
    members = family.members
    for place, one in enumerate(members):
        _draw_motions(one, axes)
        if isinstance(one.measured, Portrait) and (len(members) <= FEW or place in (0, len(members) - 1)):
            lowest = int(np.argmin(one.measured.speed))
            at = (one.measured.angle[lowest], one.measured.speed[lowest])
            style = {"xytext": (0, -6), "ha": "center", "va": "top", "fontsize": "small"}
            axes.annotate(one.drives, at, textcoords="offset points", **style)
    axes.margins(y=0.12)
    axes.set(xlabel="angle (rad)", ylabel="angular speed (rad/s)")
    axes.grid(alpha=0.25)
    handles = [one for one in _key(members) if "stick" not in one.get_label()]
    style = {"fontsize": "small", "frameon": False, "loc": "lower center", "bbox_to_anchor": (0.5, 1.0)}
    axes.legend(handles=handles, ncols=2 if len(handles) == 2 else 1, **style)


def draw_portrait(one: PortraitComparison, axes: Axes, *, labelled: bool = True) -> None:
    """The measured cycle and the model's in the phase plane."""
    _draw_motions(one, axes)
    failed = [verdict.name for verdict in one.verdicts if verdict.passed is False]
    outcome = "pass" if one.passed else f"fail: {', '.join(failed)}"
    axes.set_title(f"{one.log}, {one.drives}\n{outcome}", fontsize="small")
    axes.set_xlabel("angle (rad)", fontsize="small")
    if labelled:
        axes.set_ylabel("angular speed (rad/s)", fontsize="small")
    axes.tick_params(labelsize="small")
    axes.grid(alpha=0.25)


def _draw_motions(one: PortraitComparison, axes: Axes) -> None:
    closed = np.append(np.arange(PHASES), 0)
    for motion, style, point in ((one.measured, MEASURED, MEASURED_REST), (one.model, MODEL, REST)):
        if isinstance(motion, Portrait):
            axes.plot(motion.angle[closed], motion.speed[closed], **style)
        else:
            axes.plot([motion.angle], [0.0], **point)


def _strip(axes: Axes, one: PortraitComparison, contacts: tuple[str, ...], *, labelled: bool) -> None:
    """Which disc sticks when, over one cycle: measured, the model processed alike, and the model's contact states."""
    for place, contact in enumerate(contacts):
        for motion, height, level, style in (
            (one.measured, 0.34, 0.42, {"facecolor": MEASURED["color"]}),
            (one.model, 0.24, 0.13, BAR),
        ):
            if isinstance(motion, Portrait):
                axes.broken_barh(_bars(motion.sticks[contact].strip), (place + level, height), **style)
        if isinstance(one.model, Portrait) and (held := one.model.sticks[contact].held) is not None:
            axes.broken_barh(_bars(held), (place + 0.06, 0.05), facecolor="black")
    axes.set_xlim(0, 1)
    axes.set_ylim(0, len(contacts))
    axes.set_yticks(
        [place + 0.45 for place in range(len(contacts))], list(contacts) if labelled else [""] * len(contacts)
    )
    axes.tick_params(labelsize="small", length=2)
    axes.set_xlabel("stick: share of a cycle", fontsize="small")


def _bars(strip: np.ndarray) -> list[tuple[float, float]]:
    """Begin and length of each stick, as shares of the cycle; from the middle of the strip on, since sticks lie where
    the angle rises and would be cut in two."""
    shown = stretches(np.roll(strip > 0.5, PHASES // 2))
    return [(float(first) / PHASES, float(last - first) / PHASES) for first, last in shown]


def draw_diagram(family: FamilyComparison, axes: Axes) -> None:
    """Share of stick over the drive speed, with bracket and prediction of every bifurcation."""
    contacts = tuple(family.members[0].drive_speeds)
    for contact, mark in zip(contacts, MARKS, strict=False):
        speeds = [member.drive_speeds[family.varied] for member in family.members]
        both = {kind: [getattr(member, kind) for member in family.members] for kind in ("measured", "model")}
        shares = {
            kind: [motion.sticks[contact].fraction if isinstance(motion, Portrait) else 0.0 for motion in motions]
            for kind, motions in both.items()
        }
        name = f" {contact}" if len(contacts) > 1 else ""
        axes.plot(speeds, shares["measured"], color="#999999", marker=mark, markersize=11, linestyle="none",
                  label=f"measured{name}")  # fmt: skip
        axes.plot(speeds, shares["model"], color="black", marker=mark, markersize=5, markerfacecolor="white",
                  linestyle=":", linewidth=0.9, label=f"model{name}")  # fmt: skip
    if family.hopf is not None:
        axes.axvline(family.hopf, color="black", linestyle=":", linewidth=1.2,
                     label=f"steady sliding stable above {family.hopf:.4g} rad/s (model)")  # fmt: skip
    for bifurcation in family.bifurcations:
        _bifurcation(axes, bifurcation)
    axes.set_ylim(-0.02, 1.1 * axes.get_ylim()[1])  # marks at the edge stay whole
    axes.set_xlabel(f"drive speed of {family.varied} (rad/s)", fontsize="small")
    axes.set_ylabel("stick fraction (1)", fontsize="small")
    axes.tick_params(labelsize="small")
    axes.grid(alpha=0.25)
    axes.legend(fontsize="small", frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.22), ncols=1)


def _bifurcation(axes: Axes, one: BifurcationComparison) -> None:
    if one.measured is not None and np.isfinite(one.measured.high):
        low, high = one.measured.low, one.measured.high
        axes.axvspan(low, high, facecolor="#dddddd", edgecolor="none", zorder=0)
        axes.plot([], [], color="#dddddd", linewidth=8, label=f"measured between {low:.4g} and {high:.4g} rad/s")
    if one.measured is not None and one.measured.estimate is not None:
        reach = COVER * (one.measured.deviation or 0.0)
        label = f"measured, carried on to no stick: {measured_speed(one.measured)} rad/s (95 %)"
        axes.errorbar([one.measured.estimate], [0.0], xerr=[reach], color="#777777", marker="D", markersize=7,
                      capsize=4, linestyle="none", clip_on=False, label=label)  # fmt: skip
    if one.predicted is not None:
        reach = COVER * one.predicted.deviation
        known = " (model, 95 %)" if np.isfinite(reach) else " (model)"
        label = f"{one.predicted.words}: {speed_within(one.predicted.speed, reach)} rad/s{known}"
        axes.axvline(one.predicted.speed, color="black", linestyle="--", linewidth=1.3, label=label)
        if np.isfinite(reach):
            for edge in (one.predicted.speed - reach, one.predicted.speed + reach):
                axes.axvline(edge, color="black", linewidth=0.5)
