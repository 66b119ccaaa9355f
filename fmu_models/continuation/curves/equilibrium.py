"""Curves of equilibria in two parameters, told in words of equilibria: they are traced as those of motions, whose
multipliers are exponentials of eigenvalues."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.continuation.curves.curve import Curve, CurvePoint
from fmu_models.continuation.problem.equilibrium import eigenvalues_of
from fmu_models.continuation.special.kinds import HOPF

# what a meeting of motions is where they are equilibria
NAMES = {
    **{"1:1 resonance": "Bogdanov-Takens", "fold-Neimark-Sacker": "fold-Hopf"},
    **{"pitchfork-Neimark-Sacker": "pitchfork-Hopf"},
}


def still(curve: Curve) -> Curve:
    """The same with eigenvalues for multipliers, and the periods of small cycles at Hopf points."""
    spectra = np.array([eigenvalues_of(node) for node in curve.nodes])
    hopf = curve.kind == HOPF
    return replace(
        curve,
        multipliers=spectra,
        called="eigenvalues",
        periods=np.array([_period(eigenvalues) if hopf else np.nan for eigenvalues in spectra]),
        meetings=tuple(_told(meeting, curve) for meeting in curve.meetings),
    )


def _told(point: CurvePoint, curve: Curve) -> CurvePoint:
    with np.errstate(divide="ignore"):
        eigenvalues: Any = np.log(point.multipliers) / point.period
    period = _period(eigenvalues) if curve.kind == HOPF else np.nan
    return replace(point, kind=NAMES.get(point.kind, point.kind), multipliers=eigenvalues, period=period)


def _period(eigenvalues: NDArray[np.complex128]) -> float:
    """Of the pair that is nearest to the imaginary axis, s."""
    with np.errstate(divide="ignore"):
        return float(2.0 * np.pi / np.abs(eigenvalues[np.abs(eigenvalues.real).argmin()].imag))
