"""The posterior of a fit as a corner plot: each unknown's density, and every pair's contours.

corner (Foreman-Mackey 2016, JOSS 1, 24) draws it; imported only here, inside the function, as matplotlib is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.inference.posterior import QUANTILES, Posterior

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.figure import Figure

COLOUR = "#0072b2"
WITHIN = (0.393, 0.864)  # shares of the samples inside one and two deviations of a normal pair


def posterior_figure(found: Posterior | None, title: str, values: Mapping[str, float], names: Sequence[str]) -> Figure:
    """A corner plot of the unknowns named; lines: the ``values`` that were fitted, dashed: 95 %. StickslipError: corner
    is not installed, there are no samples, or a name is not among their unknowns."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    try:
        import corner
    except ImportError as error:
        raise StickslipError("corner is not installed. Install it: pip install 'stickslip[posterior]'") from error
    if found is None or found.samples is None:
        raise StickslipError("The fit holds no samples of a posterior. Fit the logs again with --posterior.")
    known = [marginal.name for marginal in found.marginals]
    if missing := [name for name in names if name not in known]:
        raise StickslipError(f"The posterior has no unknown '{missing[0]}'; it has {', '.join(known)}.")
    places = [known.index(name) for name in names]
    units = [found.marginals[place].unit for place in places]
    size = 2.4 * len(names) + 0.6
    figure = Figure(figsize=(size, size))
    options: dict[str, Any] = {
        "labels": [f"{name} ({unit})" for name, unit in zip(names, units, strict=True)],
        "quantiles": (QUANTILES[0], QUANTILES[-1]),
        "levels": WITHIN,
        "color": COLOUR,
        "smooth": 1.0,
        "truths": [values.get(name) for name in names],
        "truth_color": "black",
    }
    if len(names) == 1:  # corner draws no truths there, but an error
        options["truths"] = None
    corner.corner(np.asarray(found.samples)[:, places], fig=figure, **options)
    if len(names) == 1 and names[0] in values:
        figure.axes[0].axvline(values[names[0]], color="black")
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if isinstance(axis.get_major_locator(), MaxNLocator):
                # none at the ends, where those of the next panel stand; few, as their numbers are long
                axis.set_major_locator(MaxNLocator(4, prune="both"))
    figure.suptitle(
        f"{title}, posterior\n{found.independent:.0f} independent samples\n"
        "solid: fit; dashed: 95 %\ncontours: 39 and 86 %",
        x=0.98,
        ha="right",
    )
    return figure
