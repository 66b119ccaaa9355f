"""Base parameters: what efforts can tell of a machine, whatever its motion.

Columns of the regressor that depend on earlier ones, in the order of the declaration, are taken up by these: theta_k
moves the base parameters theta_i by c_ik theta_k. What no motion needs drops out.

Source: Gautier (1991), J. Robotic Systems 8, 485 (by QR); here by Gram-Schmidt in a given order, which is QR without
pivots.
"""

from dataclasses import dataclass

import numpy as np

from fmu_models.base.shown import Shown
from identification.machines.regressor import GIVEN, Regressor

SAMPLES = 60  # of random motion, for each monomial
DEPENDENT = 1e-9  # relative to the column: what is left of one that others make up
SEED = 20


@dataclass(frozen=True)
class BaseParameter(Shown):
    """A base parameter: the monomial that names it, and the others that it absorbs, with their factors."""

    index: int
    name: str
    unit: str
    others: tuple[tuple[str, float], ...]
    frictional: bool

    @property
    def combination(self) -> str:
        """The combination as text, such as "I1 + 0.04 m2 - 0.2 m1 r1"."""
        terms = [f"{'-' if factor < 0 else '+'} {_factor(abs(factor))}{name}" for name, factor in self.others]
        return " ".join([self.name, *terms])


@dataclass(frozen=True, eq=False)
class Base:
    """Base parameters (b,); combine (b, m): from all monomials to them; silent: monomials that no effort shows; given:
    column of what is known, if there is any."""

    parameters: tuple[BaseParameter, ...]
    combine: np.ndarray
    silent: tuple[str, ...]
    given: int | None

    @property
    def places(self) -> list[int]:
        """Columns of the base parameters in the regressor."""
        return [parameter.index for parameter in self.parameters]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the monomials after which the base parameters are named."""
        return tuple(parameter.name for parameter in self.parameters)

    def whole(self, values: np.ndarray) -> np.ndarray:
        """Values (m,) of all monomials by those (b,) of the base parameters: 1 for what is given, else 0."""
        monomials = np.zeros(self.combine.shape[1])
        monomials[self.places] = values
        if self.given is not None:
            monomials[self.given] = 1.0
        return monomials


def base_parameters(regressor: Regressor) -> Base:
    """The base parameters of a machine, found by random motion."""
    rng = np.random.default_rng(SEED)
    count = len(regressor.joints)
    samples = max(SAMPLES, 3 * len(regressor.names))
    motion = [rng.uniform(-np.pi, np.pi, (samples, count)), *rng.normal(0.0, 3.0, (2, samples, count))]
    columns = regressor(*motion).reshape(-1, len(regressor.names))
    return _base(regressor, columns)


def _base(regressor: Regressor, columns: np.ndarray) -> Base:
    sizes = np.linalg.norm(columns, axis=0)
    basis = np.zeros((len(columns), 0))
    taken: list[int] = []
    combine = np.zeros((0, columns.shape[1]))
    for index, size in enumerate(sizes):
        if size == 0 or regressor.names[index] == GIVEN:
            continue
        unit = columns[:, index] / size
        residual = unit - basis @ (basis.T @ unit)
        residual -= basis @ (basis.T @ residual)  # once more, for what rounding left
        length = float(np.linalg.norm(residual))
        if length > DEPENDENT:
            basis = np.column_stack([basis, residual / length])
            taken.append(index)
            combine = np.vstack([combine, np.zeros(columns.shape[1])])
            combine[-1, index] = 1.0
        else:
            combine[:, index] = np.linalg.lstsq(columns[:, taken], columns[:, index], rcond=None)[0]
    combine[np.abs(combine) < DEPENDENT] = 0.0
    parameters = tuple(
        BaseParameter(
            index,
            regressor.names[index],
            regressor.units[index],
            tuple((regressor.names[i], float(row[i])) for i in map(int, np.flatnonzero(row)) if i != index),
            bool(regressor.frictional[index]),
        )
        for index, row in zip(taken, combine, strict=True)
    )
    silent = tuple(n for n, size in zip(regressor.names, sizes, strict=True) if size == 0 and n != GIVEN)
    column = regressor.names.index(GIVEN) if GIVEN in regressor.names else None
    return Base(parameters, combine, silent, column)


def _factor(value: float) -> str:
    return "" if abs(value - 1) < DEPENDENT else f"{value:.6g} "
