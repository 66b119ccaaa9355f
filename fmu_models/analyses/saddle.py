"""A saddle equilibrium of an FMU: where it is, its eigenvalues, and the directions of motions that leave and come."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fmu_models.base.arrays import Complex, Vector
from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.field import VectorField
from fmu_models.simulation.run import check_settings

STEPS, ACCURATE = 50, 1e-13


@dataclass(frozen=True, eq=False)
class Saddle:
    """An equilibrium with motions that come and motions that leave.

    Attributes:
        fmu: the model.
        field: its rates.
        given: values of parameters and inputs that are not at their default.
        point: (n,) states.
        slopes: (n, n) derivative of the rates.
    """

    fmu: Fmu
    field: VectorField
    given: Mapping[str, float]
    point: Vector
    slopes: Vector

    @property
    def name(self) -> str:
        """Name of the model."""
        return str(self.fmu.description.modelName)

    @cached_property
    def sizes(self) -> Vector:
        """(n,) nominal values of the states."""
        return np.array([self.fmu.size_of(name) for name in self.fmu.states])

    @cached_property
    def _eigen(self) -> tuple[Complex, Complex]:
        eigen: Any = np.linalg.eig(self.slopes)
        values, vectors = eigen
        order = np.argsort(-values.real)
        return values[order].astype(complex), vectors[:, order].astype(complex)

    @property
    def values(self) -> Complex:
        """(n,) eigenvalues by falling real part, 1/s."""
        return self._eigen[0]

    def direction(self, i: int) -> Vector:
        """(n,) the real part of an eigenvector in sizes of the states, of length one, its largest part positive."""
        vector = self._eigen[1][:, i].real / self.sizes
        vector = vector / np.linalg.norm(vector)
        return vector * np.sign(vector[np.abs(vector).argmax()])

    def left(self, i: int) -> Vector:
        """(n,) the row that gives the part of a difference of states along an eigenvector."""
        row = np.linalg.inv(self._eigen[1])[i].real
        return row / (row @ (self.direction(i) * self.sizes))

    @property
    def unstable(self) -> list[int]:
        """Numbers of the real eigenvalues above zero."""
        return [i for i, value in enumerate(self.values) if value.real > 0.0 and value.imag == 0.0]

    @property
    def stable(self) -> list[int]:
        """Numbers of the real eigenvalues below zero."""
        return [i for i, value in enumerate(self.values) if value.real < 0.0 and value.imag == 0.0]

    def as_run(self, point: Vector) -> dict[str, Any]:
        """Arguments of ``simulate`` for the motion from a point (n,)."""
        return {**self.fmu.settings(self.given), "start": dict(zip(self.fmu.states, point.tolist(), strict=True))}

    def at(self, **values: float) -> Saddle:
        """The same saddle at other values of parameters or inputs, found from here.

        Raises:
            StickslipError: it is no longer there.
        """
        constants = {**self.given, **values}
        field = VectorField(self.fmu, constants)
        point, slopes = rest_near(self.fmu, field, self.point)
        return _checked(replace(self, field=field, given=constants, point=point, slopes=slopes))


def saddle_of(fmu: Fmu, start: Mapping[str, float], given: Mapping[str, float] | None = None) -> Saddle:
    """The saddle near a start.

    Args:
        fmu: of this suite.
        start: states near it; as declared what is left out.
        given: values of parameters and inputs that are not at their default.

    Raises:
        StickslipError: an FMU of others, unknown names or values out of range, no equilibrium near, or no saddle.
    """
    given = dict(given or {})
    if not fmu.ours:
        raise StickslipError(
            f"'{fmu.path}' is not of this suite, whose rates have exact derivatives; export it with stickslip."
        )
    check_settings(fmu, "parameter or input", given, [*fmu.parameters, *fmu.inputs])
    check_settings(fmu, "state", start, fmu.states)
    field = VectorField(fmu, given)
    point = np.array([float(start.get(name, fmu.start_of(name))) for name in fmu.states])
    point, slopes = rest_near(fmu, field, point)
    return _checked(Saddle(fmu, field, given, point, slopes))


def rest_near(fmu: Fmu, field: VectorField, point: Vector) -> tuple[Vector, Vector]:
    """The equilibrium near a point by Newton's method, and the derivative of the rates there."""
    sizes = np.array([fmu.size_of(name) for name in fmu.states])
    for _ in range(STEPS):
        slopes = field.slopes(point, ())
        try:
            step = np.linalg.solve(slopes, field.at(point).rates)
        except np.linalg.LinAlgError:
            break
        point = point - step
        if not np.isfinite(point).all():
            break
        if np.abs(step / sizes).max() < ACCURATE:
            return point, field.slopes(point, ())
    raise StickslipError(f"No equilibrium of '{fmu.description.modelName}' was found near that start. Start nearer.")


def _checked(saddle: Saddle) -> Saddle:
    if not (saddle.unstable and saddle.stable):
        listing = f"eigenvalues: they are {', '.join(f'{value:.4g}' for value in saddle.values)}."
        raise StickslipError(f"The equilibrium of '{saddle.name}' near that start is no saddle with real {listing}")
    return saddle
