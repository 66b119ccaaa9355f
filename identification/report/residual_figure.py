"""What is left when the model is taken off: mean residual against slip speed, and correlation of residuals.

A model that is right leaves residuals without trend over the slip speed; coloured ones (correlated from sample to
sample) are no fault of the model, but a reason not to trust plain standard deviations.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from identification.inference.whiteness import BEYOND
from identification.report.friction_figure import COLOURS, MARKS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from identification.fit.result import FrictionFit
    from identification.inference.problem import Evaluation

LAGS = 40


def residual_figure(fit: FrictionFit, evaluation: Evaluation | None) -> Figure:
    """Residuals of a fit; their correlation only where they are given."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0 if evaluation is not None else 5.4, 3.6), layout="constrained")
    panels = figure.subplots(1, 2 if evaluation is not None else 1, squeeze=False).ravel()
    _by_speed(panels[0], fit)
    if evaluation is not None:
        _correlation(panels[1], fit, evaluation)
    return figure


def _by_speed(axes: Axes, fit: FrictionFit) -> None:
    speeds = fit.whiteness.speeds if fit.whiteness is not None else ()
    slip = np.array([speed.slip for speed in speeds])
    mean = np.array([speed.mean for speed in speeds])
    error = np.array([abs(speed.mean / speed.deviations) if speed.deviations else 0.0 for speed in speeds])
    axes.errorbar(slip, mean, yerr=BEYOND * error, fmt="o", color="black", markersize=4, capsize=3,
                  label=f"mean ± {BEYOND:g} standard errors")  # fmt: skip
    axes.axhline(0.0, color="black", linewidth=1.0)
    axes.set(xlabel="slip speed (m/s)", ylabel="mean residual / rms (1)")
    axes.legend(fontsize="small", frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    axes.grid(alpha=0.25)


def _correlation(axes: Axes, fit: FrictionFit, evaluation: Evaluation) -> None:
    for number, log in enumerate(fit.logs):
        rows = evaluation.log == number
        if not rows.any():
            continue
        values = correlations(evaluation.residual[rows], evaluation.cluster[rows])
        style = {"color": COLOURS[number % len(COLOURS)], "marker": MARKS[number % len(MARKS)], "markersize": 3}
        axes.plot(np.arange(1, len(values) + 1), values, linewidth=1.0, label=log.name, **style)
    band = 1.96 / np.sqrt(max(min(int(np.sum(evaluation.log == n)) for n in np.unique(evaluation.log)), 1))
    axes.axhspan(-band, band, facecolor="#dddddd", edgecolor="none", zorder=0, label="95 % of white residuals")
    axes.axhline(0.0, color="black", linewidth=1.0)
    axes.set(xlabel="lag (values)", ylabel="autocorrelation of residuals (1)")
    axes.legend(fontsize="small", frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    axes.grid(alpha=0.25)


def correlations(residual: np.ndarray, cluster: np.ndarray, lags: int = LAGS) -> np.ndarray:
    """Autocorrelation (m,) of residuals (n,) at lags 1..m, pairs within clusters (n,) only."""
    power = float(residual @ residual)
    found = []
    for lag in range(1, lags + 1):
        same = cluster[lag:] == cluster[:-lag]
        if not same.any() or power == 0:
            break
        # pairs that reach from one cluster to the next are missing from the sum, not counted as zeros
        found.append(float((residual[lag:] * residual[:-lag])[same].mean()) / (power / len(residual)))
    return np.array(found)
