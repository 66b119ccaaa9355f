"""How families of motions are drawn in given axes, and what they say in words (`fmu_models.base.shown`)."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.analyses.basins import FAILED, INFINITE, UNDECIDED, Basins
from fmu_models.analyses.chart import Chart
from fmu_models.analyses.continuation.branch import MULTIPLIER, Branch, Branches
from fmu_models.analyses.continuation.curve import Curve, Curves
from fmu_models.analyses.continuation.equilibria import EIGENVALUES, EquilibriumBranch, SpecialEquilibrium
from fmu_models.analyses.continuation.special import Special
from fmu_models.analyses.diagram import Diagram
from fmu_models.analyses.homoclinic import Homoclinic
from fmu_models.analyses.lyapunov import Exponents
from fmu_models.analyses.manifolds import Manifolds
from fmu_models.analyses.poincare import PoincareSection
from fmu_models.analyses.spectrum import Spectrum
from fmu_models.base.shown import draw, tell

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    Vector = NDArray[Any]

# Okabe and Ito: told apart by all kinds of eyes
COLOURS = (
    *("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#F0E442", "#999999"),
    *("#003A59", "#7A5500", "#00513B", "#6B3D54", "#B3DDF5", "#F2B48F", "#FAF5B0", "#DDDDDD"),
)
UNLABELLED = {UNDECIDED: ("undecided", "////"), INFINITE: ("to infinity", "...."), FAILED: ("failed", "xxxx")}
SWEEPS = {"up": "black", "down": COLOURS[5]}
NONE = "#E5E5E5"  # of motions that do not repeat themselves, in charts of periods
DENSE = 20000  # points of a section from which on their density is drawn
# of what is special on a branch
MARKS = {
    **{"fold": "s", "flip": "D", "Neimark-Sacker": "*", "pitchfork": "P", "branch point": "p", "Hopf": "h"},
    **{"grazing, compliant": "o", "grazing, rigid": "v", "grazing-sliding corner": "^", "touch": "<"},
    **{"sliding exchange": ">", "jump": "X", "flip of the parent": "d"},
    **{"discontinuous Hopf": "H", "discontinuous fold": "8", "multiple crossing": "*", "boundary equilibrium": "o"},
    **{"end at a surface": "X"},
}
# of curves of specials, by the number of their kind
DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (8, 2)), (0, (1, 2)), (0, (3, 1)), *["-"] * 8)
SAID, WIDTHS = ("stable", "unstable"), (2.0, 0.7)
FEW = 200  # different points up to which each is a dot
FLOOR = 1e-8  # of the largest line: those below are not drawn


@draw.register(Diagram)
def _(diagram: Diagram, axes: Axes) -> None:
    """One state over the parameter; where sweeps agree the one down is a smaller dot on that of the one up."""
    for k, way in enumerate(diagram.directions):
        shown = diagram.shown[k]
        across = np.broadcast_to(diagram.values[:, None], shown.shape)
        axes.plot(
            across.ravel(),
            shown.ravel(),
            "o",
            color=SWEEPS[way],
            markersize=(2.0, 0.9)[k],
            markeredgewidth=0.0,
            rasterized=shown.size > DENSE,
        )
    if diagram.branches is not None:
        _draw_branches(diagram.branches.branches, diagram.of, axes)
    axes.set_xlabel(_label(diagram.over, diagram.units))
    axes.set_ylabel(_label(diagram.of, diagram.units))
    axes.set_title(diagram.model, fontsize="medium")
    if len(diagram.directions) > 1:
        dots = [
            axes.plot([], [], "o", color=SWEEPS[way], markersize=5, label=f"swept {way}")[0]
            for way in diagram.directions
        ]
        legend = axes.get_legend()
        if legend is None:
            axes.legend(handles=dots, frameon=False)
        else:
            _legend_below(axes, [*dots, *legend.legend_handles])


def colours_of(classes: Sequence[str]) -> list[str]:
    """A colour for each class; what does not repeat itself has a pale one."""
    return [NONE if name == "0" else COLOURS[i % len(COLOURS)] for i, name in enumerate(classes)]


def _mesh(axes: Axes, labels: Any, axes_of: Mapping[str, Any], classes: Sequence[str], said: Sequence[str]) -> None:
    """Classes as colours, with a legend that says them; what has none is hatched."""
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    (name, rows), (other, columns) = axes_of.items()
    colours = colours_of(classes) or [NONE]
    axes.pcolormesh(
        rows,
        columns,
        np.ma.masked_less(labels, 0).T,
        cmap=ListedColormap(colours),
        vmin=-0.5,
        vmax=len(colours) - 0.5,
        rasterized=True,
        shading="nearest",
    )
    handles = [Patch(facecolor=colour, label=text) for colour, text in zip(colours, said, strict=False)]
    for value, (text, hatch) in UNLABELLED.items():
        if (labels == value).any() and min(labels.shape) > 1:
            part = np.ma.masked_where(labels != value, np.ones(labels.shape)).T
            white = ListedColormap(["white"])
            axes.pcolor(rows, columns, part, hatch=hatch, cmap=white, shading="nearest", edgecolor="0.4", linewidth=0.0)
            handles.append(Patch(facecolor="white", edgecolor="0.4", hatch=hatch, label=text))
    axes.set_xlabel(name)
    axes.set_ylabel(other)
    beside: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0)}
    if axes.figure is not None and len(axes.figure.axes) > 1:  # panels side by side have no room between them
        beside = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.16), "ncols": 2}
    axes.legend(handles=handles, frameon=False, fontsize="small", **beside)


@draw.register(Basins)
def _(basins: Basins, axes: Axes) -> None:
    names = list(basins.axes)
    if len(names) != 2:
        axes.plot(basins.axes[names[0]], basins.labels.reshape(len(basins.axes[names[0]]), -1), ".", color="black")
        axes.set_xlabel(names[0])
        axes.set_ylabel("attractor")
        return
    said = attractors_of(basins)
    _mesh(axes, basins.labels, basins.axes, said, said)
    limits = axes.get_xlim(), axes.get_ylim()
    for i, attractor in enumerate(basins.attractors):
        axes.plot(
            *(attractor.points[:, basins.states.index(name)] for name in names),
            "o" if attractor.period else ",",
            markerfacecolor=COLOURS[i % len(COLOURS)],
            markeredgecolor="black",
            color="black",
            markersize=6,
            markeredgewidth=1.2,
        )
    axes.set_xlim(limits[0])
    axes.set_ylim(limits[1])
    axes.set_title(basins.model, fontsize="medium")


def attractors_of(basins: Basins) -> list[str]:
    """What each attractor is, and its share of the starts."""
    words = (
        "-".join(map(str, (one.period, *getattr(one, "began", ())))) if one.period else "chaotic"
        for one in basins.attractors
    )
    return [f"{word} ({100 * share:.3g} %)" for word, share in zip(words, basins.shares, strict=True)]


def classes_of(chart: Chart) -> list[str]:
    """What the classes of a chart say."""
    return ["none found" if name == "0" else name for name in chart.classes]


@draw.register(Chart)
def _(chart: Chart, axes: Axes) -> None:
    _mesh(axes, chart.labels, chart.axes, chart.classes, classes_of(chart))
    legend = axes.get_legend()
    assert legend is not None
    legend.set_title(chart.what)
    axes.set_title(chart.model, fontsize="medium")


@draw.register(Branch)
def _(branch: Branch, axes: Axes) -> None:
    _draw_branches((branch,), branch.states[0], axes)


@draw.register(Branches)
def _(found: Branches, axes: Axes) -> None:
    _draw_branches(found.branches, found.of, axes)


def _draw_branches(branches: Sequence[Branch], of: str, axes: Axes) -> None:
    """Stable motions by thick lines, unstable ones by thin lines, what is special by marks; where the word changes a
    dotted line between the multipliers on both sides."""
    marks: dict[str, list[tuple[float, float]]] = {}
    for branch in branches:
        _draw_lines(*_lines(branch, of), "black", axes)
        for special in branch.special:
            heights = _heights(special, of, branch.every)
            marks.setdefault(special.kind, []).extend((special.value, height) for height in heights)
            if len(heights) > 1 and of == MULTIPLIER:
                axes.plot([special.value] * 2, heights, ":", color="black", linewidth=1.0)
    handles = _legend_of(marks, axes)
    for bound in (-1.0, 1.0) if of == MULTIPLIER else ():
        axes.axhline(bound, color="0.7", linewidth=0.7, zorder=0)
    axes.autoscale_view()
    axes.set_xlabel(_label(branches[0].over, branches[0].units))
    axes.set_ylabel("real part of the largest multiplier" if of == MULTIPLIER else _label(of, branches[0].units))
    axes.set_title(branches[0].model, fontsize="medium")
    _legend_below(axes, handles)


def _draw_lines(values: Vector, stable: Vector, lines: Vector, colour: str, axes: Axes) -> None:
    """Heights (k, m) over values (m,), pieces thick where they are stable (m - 1,)."""
    from matplotlib.collections import LineCollection

    for y in lines:
        points = np.stack([values, y], 1)
        pieces, widths = np.stack([points[:-1], points[1:]], 1), np.where(stable, *WIDTHS)
        axes.add_collection(LineCollection(list(pieces), linewidths=widths, colors=colour, capstyle="round"))


def _legend_of(marks: Mapping[str, list[tuple[float, float]]], axes: Axes) -> list[Any]:
    """Lines, and marks by kind, which are drawn where they lie."""
    handles = [
        axes.plot([], [], "-", color="black", linewidth=w, label=name)[0] for name, w in zip(SAID, WIDTHS, strict=True)
    ]
    for kind, mark in MARKS.items():
        if kind in marks:
            x, y = np.array(marks[kind]).T
            colour = COLOURS[list(MARKS).index(kind) % len(COLOURS)]
            size = 9 if mark == "*" else 5
            (drawn,) = axes.plot(
                x, y, mark, color=colour, markeredgecolor="black", markersize=size, label=kind, zorder=4
            )
            handles.append(drawn)
    return handles


def _legend_below(axes: Axes, handles: Sequence[Any]) -> None:
    """Where it hides nothing."""
    columns = 3 if max(len(str(one.get_label())) for one in handles) < 25 else 2
    axes.legend(
        handles=handles, frameon=False, fontsize="small", loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=columns
    )


def _lines(branch: Branch, of: str) -> tuple[Vector, Vector, Vector]:
    """What a branch is drawn by: values (m,), whether the pieces between are stable (m - 1,), heights (k, m) of each of
    its points; its specials lie among them, but for those where the word changes and with it the multipliers."""
    jumps = of == MULTIPLIER
    lines = branch.multipliers[None, :, 0].real if jumps else branch.images[:, :, branch.states.index(of)]
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
        return [float(np.real(one[0])) for one in sides if one is not None]
    place = list(special.state).index(of)
    return [float(special.state[of]), *(float(special.at(float(k))[place]) for k in range(1, every))]


def _label(name: str, units: Mapping[str, str]) -> str:
    """With its unit."""
    unit = units.get(name, "1")
    return name if unit == "1" else f"{name} ({unit})"


@draw.register(EquilibriumBranch)
def _(found: EquilibriumBranch, axes: Axes) -> None:
    if found.of == EIGENVALUES:
        _draw_eigenvalues(found, axes)
    else:
        _draw_equilibria(found, axes)


def _draw_equilibria(found: EquilibriumBranch, axes: Axes) -> None:
    """As branches of motions are, the cycles that leave them in another colour."""
    stable = found.stable[:-1] & found.stable[1:]
    _draw_lines(found.values, stable, found.points[None, :, found.states.index(found.of)], "black", axes)
    marks: dict[str, list[tuple[float, float]]] = {}
    for special in found.special:
        marks.setdefault(special.kind, []).append((special.value, special.state[found.of]))
    for cycles in found.cycles:
        _draw_lines(*_lines(cycles, found.of), COLOURS[0], axes)
        for special in cycles.special:
            marks.setdefault(special.kind, []).append((special.value, special.state[found.of]))
    handles = _legend_of(marks, axes)
    if found.cycles:
        handles.append(axes.plot([], [], color=COLOURS[0], label="cycles, where they begin")[0])
    axes.autoscale_view()
    axes.set_xlabel(_label(found.over, found.units))
    axes.set_ylabel(_label(found.of, found.units))
    axes.set_title(found.model, fontsize="medium")
    _legend_below(axes, handles)


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


@draw.register(Curve)
def _(curve: Curve, axes: Axes) -> None:
    _draw_curves((curve,), axes)


@draw.register(Curves)
def _(found: Curves, axes: Axes) -> None:
    _draw_curves(found.curves, axes)


def _draw_curves(curves: Sequence[Curve], axes: Axes) -> None:
    """A colour and a dash for each kind, a numbered dot where a curve has a point of codimension 2."""
    kinds = [kind for kind in MARKS if any(one.kind == kind for one in curves)]
    said: set[str] = set()
    met: dict[str, list[tuple[float, float]]] = {}
    for curve in curves:
        style = {"color": COLOURS[kinds.index(curve.kind) % len(COLOURS)], "linestyle": DASHES[kinds.index(curve.kind)]}
        label = None if curve.kind in said else curve.kind
        said.add(curve.kind)
        axes.plot(curve.seconds, curve.values, label=label, **style)
        for one in curve.meetings:
            met.setdefault(one.kind, []).append((one.parameters[curve.second], one.parameters[curve.over]))
    for i, (kind, places) in enumerate(met.items(), 1):
        axes.plot(*np.array(places).T, "o", color="black", markersize=4, label=f"{i} {kind}", zorder=4)
        for place in places:
            axes.annotate(str(i), place, fontsize="small", xytext=(4, 4), textcoords="offset points")
    axes.set_xlabel(_label(curves[0].second, curves[0].units))
    axes.set_ylabel(_label(curves[0].over, curves[0].units))
    axes.set_title(curves[0].model, fontsize="medium")
    _legend_below(axes, axes.get_legend_handles_labels()[0])


@tell.register(Curve)
def _(curve: Curve) -> str:
    """Its points of codimension 2, and the ends."""
    (kind, why), last = curve.ends
    lines = [curve._heading(), f"  {kind}: {why}"]
    for met in curve.meetings:
        at = ", ".join(f"{name} = {value:.15g}" for name, value in met.parameters.items())
        lines.append(f"  {met.kind} at {at}; multipliers {', '.join(_number(one) for one in met.multipliers)}")
    return "\n".join([*lines, f"  {last[0]}: {last[1]}"])


@tell.register(Curves)
def _(found: Curves) -> str:
    return "\n".join(tell(one) for one in found.curves)


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


@tell.register(EquilibriumBranch)
def _(found: EquilibriumBranch) -> str:
    """What is special, in the order of the branch, the ends, and the cycles that leave."""
    (kind, why), last = found.ends
    lines = [f"{found._heading()}: {found.stable.sum()} stable", f"  {kind}: {why}"]
    lines += [f"  {_told_equilibrium(one)}" for one in found.special]
    lines.append(f"  {last[0]}: {last[1]}")
    return "\n".join([*lines, *(tell(one) for one in found.cycles)])


def _told_equilibrium(special: SpecialEquilibrium) -> str:
    kind = f"{special.kind}, {special.criticality}" if special.criticality else special.kind
    line = f"{kind} at {special.parameter} = {special.value:.15g}; eigenvalues {_numbers(special.eigenvalues)}"
    if special.eigenvalues_after is not None:
        line += f"; beyond {_numbers(special.eigenvalues_after)}"
        line += "; two equilibria meet" if special.turns else ""
    for where, shares in special.crossings.items():
        each = (f"q = {q:.8g} ({_numbers(row)})" for q, row in zip(shares, special.path(shares), strict=True))
        line += f"; {where} at {', '.join(each)}"
    return line


def _numbers(values: Any) -> str:
    return ", ".join(_number(one) for one in values)


def _number(value: complex) -> str:
    real, imaginary = float(np.real(value)), float(np.imag(value))
    return f"{real:.8g}" if abs(imaginary) < 1e-12 else f"{real:.8g}{imaginary:+.8g}i"


@tell.register(Branches)
def _(found: Branches) -> str:
    return "\n".join(tell(one) for one in found.branches)


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
    lines.append(f"  eigenvalues {_numbers(found.eigenvalues)}")
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
            f"  saddle {at}; eigenvalues {_numbers(found.eigenvalues)}",
            f"  {born} cycle is born there; known to {found.width:.2g}",
        ]
    )


@draw.register(Spectrum)
def _(spectrum: Spectrum, axes: Axes) -> None:
    if spectrum.lines:
        floor = spectrum.amplitude.max() * FLOOR
        kept = spectrum.amplitude > floor
        axes.vlines(spectrum.frequency[kept], floor, spectrum.amplitude[kept], color="black", linewidth=1.2)
        axes.set_ylim(floor, 3.0 * spectrum.amplitude.max())
        axes.set_ylabel(f"amplitude of {spectrum.of} ({spectrum.unit})")
    else:
        axes.plot(spectrum.frequency, spectrum.amplitude, color="black", linewidth=0.8)
        axes.fill_between(spectrum.frequency, spectrum.low, spectrum.high, color="0.8", label="95 %")
        axes.set_ylabel(f"density of {spectrum.of} (({spectrum.unit})$^2$/Hz)")
        axes.legend(frameon=False)
    axes.set_yscale("log")
    axes.set_xlabel("frequency (Hz)")


@draw.register(Exponents)
def _(found: Exponents, axes: Axes) -> None:
    number = np.arange(1, len(found.values) + 1)
    finite = np.isfinite(found.per_time)
    axes.bar(number[finite], found.per_time[finite], yerr=3 * found.per_time_errors[finite], color="0.7", capsize=4)
    for i in np.flatnonzero(~finite):
        axes.annotate("$-\\infty$", (number[i], 0.0), ha="center", va="top")
    axes.axhline(0.0, color="black", linewidth=0.8)
    axes.set_xticks(number)
    axes.set_xlabel("exponent")
    axes.set_ylabel(f"growth rate (1/{found.unit}), bars: 3 standard errors")


@draw.register(PoincareSection)
def _(section: PoincareSection, axes: Axes) -> None:
    names = section.states[:2]
    x, y = section.points[:, 0], section.points[:, min(1, section.points.shape[1] - 1)]
    if len(np.unique(np.round(section.points, 9), axis=0)) < FEW:
        axes.plot(x, y, "o", color="black", markersize=4)
    elif len(section.points) > DENSE:
        drawn = axes.hexbin(x, y, gridsize=150, bins="log", cmap="viridis", mincnt=1, linewidths=0.2)
        axes.figure.colorbar(drawn, ax=axes, label="points in a cell")
    else:
        axes.plot(x, y, "o", color="black", markersize=1.2, markeredgewidth=0.0)
    axes.set_xlabel(names[0])
    axes.set_ylabel(names[-1])
    axes.set_title(section.model, fontsize="medium")


@tell.register(Diagram)
def _(diagram: Diagram) -> str:
    return repr(diagram) if diagram.branches is None else f"{diagram!r}\n{tell(diagram.branches)}"


for kind in (Basins, Chart, Spectrum, Exponents, PoincareSection):
    tell.register(kind, repr)
