"""A friction law to be fitted: the functions of its declaration, and where a search for its parameters starts."""

from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np

from fmu_models.codegen.law_functions import LawFunctions, law_functions
from fmu_models.language.law_parameter import LawParameter
from identification.inference.problem import Unknown

CANDIDATES = np.geomspace(0.2, 100, 25)  # multiples of the greatest slip speed's inverse, among which a scale may start


@dataclass(frozen=True, eq=False, kw_only=True)
class FittableLaw(LawFunctions):
    """A friction law to be fitted. beforehand: as in `inference.problem.Problem`, of its parameters (k, m)."""

    beforehand: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))

    def __reduce__(self) -> tuple[Any, ...]:
        """State for another process, which makes the law from its declaration again."""
        return _again, (self.reference, self.parameters)

    @property
    def at_rest(self) -> int | None:
        """Which parameter is the friction coefficient at zero slip speed; None if none is."""
        q = np.array([0.5 + 0.1 * index for index in range(len(self.parameters))])
        slope, value = self.gradient(np.array(0.0), q), self.value(np.array(0.0), q)
        matches = np.flatnonzero(np.isclose(slope, 1.0) & np.isclose(q, value))
        return int(matches[0]) if len(matches) == 1 and np.count_nonzero(slope) == 1 else None

    def start(self, v: np.ndarray, mu: np.ndarray) -> np.ndarray:
        """First guess (m,) from slip speeds v (n,) and rough coefficients mu (n,).

        For fixed values of the others mu is linear in the linear parameters: the best of a range of scales, with no
        negative coefficient. What has another unit than a scale of speed stays at its default.
        """
        from scipy.optimize import nnls

        free = np.array(self.linear)
        best, least = np.zeros(0), np.inf
        for guess in product(*(self._candidates(index, np.max(np.abs(v))) for index in range(len(self.parameters)))):
            q = np.where(free, 0.0, guess)
            # the triangle of a tall system has the same solution and misfit
            triangle = np.asarray(
                np.linalg.qr(np.column_stack([*self.gradient(v, q)[free], mu - self.value(v, q)]), mode="r")
            )
            solution, misfit = nnls(triangle[:, :-1], triangle[:, -1])
            if misfit < least:
                q[free] = solution
                best, least = q, misfit
        return best

    def _candidates(self, index: int, fastest: float) -> np.ndarray:
        """Values that a parameter may start at."""
        parameter = self.parameters[index]
        scales = {"s/m": CANDIDATES / fastest, "m/s": fastest / CANDIDATES}
        if self.linear[index] or parameter.unit not in scales:
            return np.array([parameter.value])
        return np.clip(scales[parameter.unit], parameter.minimum, parameter.maximum)


def fittable(reference: str) -> FittableLaw:
    """A law as a fit needs it; errors as in `law_functions`."""
    return FittableLaw(**vars(law_functions(reference)))


def _again(reference: str, parameters: tuple[LawParameter, ...]) -> FittableLaw:
    return replace(fittable(reference), parameters=parameters)


def unknowns(law: FittableLaw) -> tuple[Unknown, ...]:
    """Parameters of a law as unknowns of a problem, without priors."""
    return tuple(Unknown(p.name, p.unit, p.minimum, p.maximum, p.description) for p in law.parameters)
