"""Friction against slip speed, with the fitted law and the residuals.

Curves and marks differ in shape and line as well as in colour. matplotlib is imported only here, inside the functions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.digits import value_with_sd
from identification.laws import find_law

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from identification.estimators.releases import Breakaway
    from identification.estimators.savitzky_golay import FrictionSamples
    from identification.fit.result import FrictionFit
    from identification.free_friction.result import FreeFriction

# colours of Okabe and Ito, told apart by colour-blind readers
MARKS = ("o", "^", "s", "D", "v", "P", "X", "<", ">")
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000", "#777777", "#f0e442")
RIVALS = (":", "-.", (0, (6, 2)), (0, (1, 3)))  # lines of laws that were judged beside
SHOWN = 400  # marks per log: more hide each other
RUG = 5  # of samples, one is marked on the axis of slip speeds
WIDE = 100  # letters of a line of the title
WHOLE = "free of any law, 95 % band of the whole form"


def friction_figure(fit: FrictionFit, samples: Mapping[str, FrictionSamples]) -> Figure:
    """Measured friction coefficient against slip speed, with the fitted law, and the residuals below; by disc.

    samples: by driving disc, of `identification.fit.samples`, whichever estimator fitted the law.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0 * len(samples), 6.0), layout="constrained")
    panels = figure.subplots(2, len(samples), sharex="col", height_ratios=(2.2, 1), squeeze=False)
    for (above, below), (contact, these) in zip(panels.T, samples.items(), strict=True):
        _draw_disc(above, below, fit, contact, these)
    return figure


def _draw_disc(above: Axes, below: Axes, fit: FrictionFit, contact: str, samples: FrictionSamples) -> None:
    """Friction on one disc, and what the law leaves of it."""
    law = fitted_law(fit, contact)
    for number, log in enumerate(fit.logs):
        inside = np.flatnonzero(samples.log == number)
        if not len(inside):
            continue
        shown = inside[:: max(len(inside) // SHOWN, 1)]
        style = {
            "marker": MARKS[number % len(MARKS)],
            "color": COLOURS[number % len(COLOURS)],
            "linestyle": "none",
            "markersize": 3,
            "markerfacecolor": "none",
            "alpha": 0.6,
        }
        label = f"{log.name} ({', '.join(f'{speed:.3g}' for speed in log.drive_speeds)} rad/s)"
        above.plot(samples.slip[shown], samples.coefficient[shown], label=label, **style)
        below.plot(samples.slip[shown], samples.coefficient[shown] - law(samples.slip[shown]), **style)
    least = float(samples.slip.min()) if find_law(fit.law_reference).directed else 0.0
    speed = 1.05 * np.linspace(least, float(samples.slip.max()), 300)
    above.plot(speed, law(speed), color="black", linewidth=1.8, label=f"{fit.law} law, {fit.estimator}")
    below.axhline(0.0, color="black", linewidth=1.2)
    if fit.free:
        _draw_free(above, below, fit.free, law)
        for number, rival in enumerate(rival for rival in fit.rivals if rival.curve and rival.law != fit.law):
            style = {"linestyle": RIVALS[number % len(RIVALS)], "color": "#555555", "linewidth": 1.0, "zorder": 6}
            above.plot(fit.free.speed, rival.curve, label=f"{rival.law}, weight {rival.weight:.2g}", **style)
            below.plot(fit.free.speed, rival.curve - law(fit.free.speed), **style)
        above.plot(
            samples.slip[::RUG], 0 * samples.slip[::RUG], "|", color="#a04070", transform=above.get_xaxis_transform()
        )
    if fit.breakaway:
        _draw_releases(above, fit.breakaway)
    bins = [b for b in fit.bins if b.contact == contact and b.standard_error is not None]
    if bins:
        below.errorbar(
            [b.slip for b in bins],
            [b.coefficient - b.fitted for b in bins],
            yerr=[1.96 * (b.standard_error or 0.0) for b in bins],
            fmt="o",
            color="black",
            markersize=4,
            markerfacecolor="white",
            capsize=3,
            zorder=5,
            label=f"means used by {fit.estimator}, 95 %",
        )
        below.legend(fontsize="small", frameon=False, loc="lower right", bbox_to_anchor=(1.0, 1.0), borderpad=0.0)
    other = "" if len(fit.contacts) == 1 else f" on {contact}"
    above.set_ylabel(f"friction coefficient F/N{other} (1)")
    below.set(ylabel="residual (1)", xlabel="slip speed |r w - R th'| (m/s)")
    spread = float(np.quantile(np.abs(samples.coefficient - law(samples.slip)), 0.98))
    below.set_ylim(-1.5 * spread, 1.5 * spread)
    # a law of the wrong form may rise beyond all that was seen
    centre = fit.free.coefficient if fit.free else law(speed)
    above.set_ylim(max(float(centre.min()) - 3 * spread, 0.0), float(centre.max()) + 3 * spread)
    above.legend(fontsize="small", framealpha=0.9, loc="best")
    for axes in (above, below):
        axes.grid(alpha=0.25)
    above.set_title(_values_in_words(fit, contact), fontsize="medium")


def _draw_free(above: Axes, below: Axes, free: FreeFriction, law: Callable[[np.ndarray], np.ndarray]) -> None:
    """The curve that is free of any law, with the bands in which all of its form lies and each of its values."""
    for axes, less in ((above, np.zeros_like), (below, law)):
        _draw_band(axes, free, less)
        speed, curve, deviation = _told(free)
        ends = (curve - less(speed) - 1.96 * deviation, curve - less(speed) + 1.96 * deviation)
        style = {"facecolor": "#c06090", "edgecolor": "#a04070", "alpha": 0.5, "linewidth": 0.8}
        axes.fill_between(speed, *ends, label="the same, of one speed", zorder=3, **style)
        axes.plot(speed, curve - less(speed), color="#a04070", linestyle="--", linewidth=1.0, zorder=4)


def _draw_band(axes: Axes, free: FreeFriction, less: Callable[[np.ndarray], np.ndarray], label: str = WHOLE) -> None:
    """The band in which all of the form of the curve lies that is free of any law, less a law."""
    speed, curve, deviation = _told(free)
    middle, reach = curve - less(speed), free.simultaneous * deviation
    style = {"facecolor": "#f0a0c0", "edgecolor": "#a04070", "alpha": 0.5, "hatch": "////", "linewidth": 0.8}
    axes.fill_between(speed, middle - reach, middle + reach, label=label, zorder=3, **style)


def _told(free: FreeFriction) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Speed, coefficient and deviation where slips were seen, and from rest where releases of sticks tell it."""
    told = free.speed >= (0.0 if free.releases else free.least)
    return free.speed[told], free.coefficient[told], free.form_deviation[told]


def _draw_releases(above: Axes, breakaway: Breakaway) -> None:
    """The friction at which each stick let go, and their level."""
    levels = [release.level for release in breakaway.releases]
    above.plot(np.zeros(len(levels)), levels, "_", color="#777777", markersize=8, alpha=0.4)
    style = {"fmt": "D", "color": "black", "markersize": 4, "markerfacecolor": "white", "capsize": 3, "zorder": 5}
    label = f"release of {len(levels)} sticks, 95 %"
    above.errorbar([0.0], [breakaway.level], yerr=[1.96 * breakaway.deviation], label=label, **style)


def _values_in_words(fit: FrictionFit, contact: str) -> str:
    names = _names(fit, contact)
    fitted = (fit[name] for name in names)
    values = ", ".join(f"{q.name} = {value_with_sd(q.value, q.total_deviation, q.unit)}" for q in fitted)
    missing = dict.fromkeys(constant for name in names for constant in fit.unstated(name))
    least = f" (at least: of {', '.join(missing)} not stated)" if missing else ""
    parts = "noise, rig constants and law" if fit.rivals else "noise and rig constants"
    causes = ", ".join(cause.name for cause in fit.causes)
    corrected = f"\nmarks and means without what disturbances changed: {causes}" if causes else ""
    values = "\n".join(wrap(values, WIDE))
    return f"{values}\n± one standard deviation, {parts} together{least}{corrected}"


def draw_fit(fit: FrictionFit, axes: Axes) -> None:
    """The fitted law of each disc over slip speed, the band of the curve that is free of any law, and the means that
    the estimator used, with 95 % intervals."""
    reach = 1.05 * max((speed_bin.slip for speed_bin in fit.bins), default=1.0)
    speed = np.linspace(min(0.0, 1.05 * min((speed_bin.slip for speed_bin in fit.bins), default=0.0)), reach, 300)
    if fit.free:
        _draw_band(axes, fit.free, np.zeros_like, "free of any law, 95 %")
    for number, contact in enumerate(fit.contacts):
        colour = COLOURS[number]
        means = [speed_bin for speed_bin in fit.bins if speed_bin.contact == contact]
        error = [1.96 * (mean.standard_error or 0.0) for mean in means]
        style = {"fmt": MARKS[number], "color": colour, "markersize": 4, "markerfacecolor": "white", "capsize": 3}
        axes.plot(speed, fitted_law(fit, contact)(speed), color=colour, label=f"{fit.law} law, {contact}")
        axes.errorbar(
            [m.slip for m in means], [m.coefficient for m in means], yerr=error, label="measured means", **style
        )
    axes.set(xlabel="slip speed |r w - R th'| (m/s)", ylabel="friction coefficient F/N (1)")
    axes.legend(fontsize="small", frameon=False)
    axes.grid(alpha=0.25)


def fitted_law(fit: FrictionFit, contact: str) -> Callable[[np.ndarray], np.ndarray]:
    """The fitted friction coefficient on a disc as a function of slip speed (n,), m/s. StickslipError: the fit is of an
    unknown law."""
    law = find_law(fit.law_reference)
    values = np.array([fit[name].value for name in _names(fit, contact)])
    return lambda slip: law.value(law.along(np.abs(slip), slip), values)


def _names(fit: FrictionFit, contact: str) -> list[str]:
    """The fit's names of the parameters of one disc."""
    number = "" if len(fit.contacts) == 1 else contact[-1]
    return [f"{name}{number}" for name in find_law(fit.law_reference).names]
