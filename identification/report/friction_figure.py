"""Friction against slip speed, with the fitted law and the residuals.

Curves and marks differ in shape and line as well as in colour. matplotlib is imported only here, inside the functions.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from identification.laws import find_law

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from identification.inverse_dynamics import FrictionSamples
    from identification.result import FrictionFit

# colours of Okabe and Ito, told apart by colour-blind readers
MARKS = ("o", "^", "s", "D", "v", "P", "X", "<", ">")
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000", "#777777", "#f0e442")
SHOWN = 400  # marks per log: more hide each other


def friction_figure(fit: FrictionFit, samples: FrictionSamples) -> Figure:
    """Measured friction coefficient against slip speed, with the fitted law, and the residuals below.

    samples: of `identification.inverse_dynamics.friction_samples`, whichever estimator fitted the law.
    """
    from matplotlib.figure import Figure

    law = fitted_law(fit)
    figure = Figure(figsize=(7.0, 6.0), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1))
    for number, log in enumerate(fit.logs):
        inside = np.flatnonzero(samples.log == number)
        shown = inside[:: max(len(inside) // SHOWN, 1)]
        style = {
            "marker": MARKS[number % len(MARKS)],
            "color": COLOURS[number % len(COLOURS)],
            "linestyle": "none",
            "markersize": 3,
            "markerfacecolor": "none",
            "alpha": 0.6,
        }
        label = f"{log.name} ({log.drive_speed:.3g} rad/s)"
        above.plot(samples.slip[shown], samples.coefficient[shown], label=label, **style)
        below.plot(samples.slip[shown], samples.coefficient[shown] - law(samples.slip[shown]), **style)
    speed = np.linspace(0, 1.05 * float(samples.slip.max()), 300)
    above.plot(speed, law(speed), color="black", linewidth=1.8, label=f"{fit.law} law, {fit.estimator}")
    below.axhline(0.0, color="black", linewidth=1.2)
    bins = [b for b in fit.bins if b.standard_error is not None]
    below.errorbar(
        [b.slip for b in bins],
        [b.coefficient - b.fitted for b in bins],
        yerr=[1.96 * (b.standard_error or 0.0) for b in bins],
        fmt="_",
        color="black",
        capsize=3,
        label=f"means used by {fit.estimator}, 95 %",
    )
    above.set_ylabel("friction coefficient F/N (1)")
    below.set_ylabel("residual (1)")
    below.set_xlabel("slip speed |r w - R th'| (m/s)")
    spread = float(np.quantile(np.abs(samples.coefficient - law(samples.slip)), 0.98))
    below.set_ylim(-1.5 * spread, 1.5 * spread)
    centre = law(speed)
    above.set_ylim(max(float(centre.min()) - 3 * spread, 0.0), float(centre.max()) + 3 * spread)
    for axes in (above, below):
        axes.legend(fontsize="small", frameon=False)
        axes.grid(alpha=0.25)
    values = ", ".join(
        f"{q.name} = {q.value:.4g} ± {q.standard_deviation:.1g}" + (f" {q.unit}" if q.unit != "1" else "")
        for q in fit.parameters
    )
    above.set_title(values, fontsize="medium")
    return figure


def fitted_law(fit: FrictionFit) -> Callable[[np.ndarray], np.ndarray]:
    """The fitted friction coefficient as a function of slip speed (n,), m/s.

    Raises:
        StickslipError: the fit is of an unknown law.
    """
    law = find_law(fit.law)
    return lambda slip: law.value(np.abs(slip), fit.law_values)
