"""Fits as an estimator would return them, with known values."""

from __future__ import annotations

import numpy as np

from identification.fit.parts import Constant, FittedParameter
from identification.fit.result import FrictionFit

MATERIALS = {"paper/paper": (0.35, 0.25, 15.0), "liner/rubber": (0.5, 0.33, 20.0), "paper/rubber": (0.65, 0.35, 15.0)}
UNITS = {"mu_s": "1", "mu_k": "1", "p": "s/m"}
RIG = {"J": (0.0548, "kg*m^2"), "k": (2.62, "N*m/rad"), "c": (0.055, "N*m*s/rad"), "R": (0.125, "m"), "r": (0.06, "m")}


def made_fit(material: str = "paper/rubber", N: float = 5.0, discs: int = 1, **changes: float) -> FrictionFit:
    """A fit as an estimator would return it, on one disc or two of one material."""
    suffixes = [""] if discs == 1 else ["0", "1"]
    parameters = [
        FittedParameter(f"{name}{suffix}", value, UNITS[name], 1e-3 * value, 1e-3 * value, 0.0, 0.0, 1e4, False)
        for suffix in suffixes
        for name, value in zip(UNITS, MATERIALS[material], strict=True)
    ]
    if "theta_s" in changes:
        parameters.append(FittedParameter("theta_s", changes["theta_s"], "rad", 1e-4, 1e-4, 0.0, -1.0, 1.0, False))
    forces = {"N": (N, "N")} if discs == 1 else {"N0": (N, "N"), "N1": (N, "N")}
    constants = {name: (changes.get(name, value), unit) for name, (value, unit) in {**RIG, **forces}.items()}
    return FrictionFit(
        estimator="weak-form",
        law="Conti",
        structure=("rigid contact",),
        contacts=("disc0", "disc1")[:discs],
        materials=(material,) * discs,
        parameters=tuple(parameters),
        correlation=tuple(tuple(row) for row in np.eye(len(parameters)).tolist()),
        constants=tuple(Constant(name, value, unit, 0.0, "log", {}) for name, (value, unit) in constants.items()),
        logs=(),
        bins=(),
        sensors={},
        segments=60,
        values=600,
        rms_residual=1e-3,
        autocorrelation=0.0,
        converged=True,
        message="ok",
        warnings=(),
    )
