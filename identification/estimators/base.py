"""What every estimator of friction takes and gives."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from fmu_models.base.shown import Shown
from identification.disturbances.term import DisturbanceTerm
from identification.inference.lmfit_exchange import NOTHING, Given
from identification.inference.problem import FitProblem, Prior, Progress, Solution
from identification.laws import FittableLaw
from identification.measurement.pooled import Pool

GAIN_STEP, DELAY_STEP, CONSTANT_STEP = 1e-4, 1e-5, 1e-4  # relative, s, relative: for differences of smooth functions


@dataclass(frozen=True, eq=False)
class FrictionRows:
    """Friction as an estimator saw it.

    speed: (n,) m/s, mean slip speed; least, greatest: (n,) m/s, its range; measured, fitted: (n,) friction coefficient;
    cluster: (n,) labels; log: (n,) number of the log; disc: (n,) of the driving disc among the contacts.
    """

    speed: np.ndarray
    least: np.ndarray
    greatest: np.ndarray
    measured: np.ndarray
    fitted: np.ndarray
    cluster: np.ndarray
    log: np.ndarray
    disc: np.ndarray


class FrictionProblem(FitProblem):
    """A problem whose first unknowns are the parameters of a friction law, nuisance parameters after them.

    held: constants of the rig that are taken as given; residual_unit: of ``rows``' residual that a user reads.
    """

    held: tuple[Prior, ...]
    residual_unit: str

    @abstractmethod
    def rows(self, x: np.ndarray) -> FrictionRows:
        """Friction against slip speed at x (m,)."""

    @abstractmethod
    def by_held(self, x: np.ndarray) -> Mapping[str, np.ndarray]:
        """Derivatives (n,) of the residuals by each constant held, per its unit; and by ``gain`` (relative) and
        ``delay`` (s) of the laser, if these are not among the unknowns; ``lines`` (n, k): changes by
        draws of the misplacement of an encoder's lines, over the root of their number, and by its zero, where these are
        not."""

    def tested(self, solution: Solution) -> bool:
        """Whether the residuals of a solution tell of the model, rather than of lines of an encoder that are misplaced
        by the same at every pass."""
        return True

    @abstractmethod
    def with_held(self, priors: tuple[Prior, ...]) -> FrictionProblem:
        """The same problem with its constants at other values."""

    @abstractmethod
    def rms(self, x: np.ndarray) -> float:
        """Root mean square of the residual that a user reads, in ``residual_unit``."""


@dataclass(frozen=True)
class Options(Shown):
    """What a user may ask of any estimator. nuisance: constants of the rig (and ``zero``, of the laser) that are
    estimated along with the law, with what is known of them as priors; disturbances: terms of friction that are
    estimated with them; progress: see `inference.problem`; given: bounds
    and held values of unknowns, and first values of the first search (its result begins those of later stages);
    workers: threads, as many as there are cores if None (the result does not depend on it)."""

    nuisance: tuple[str, ...] = ()
    disturbances: tuple[DisturbanceTerm, ...] = ()
    progress: Progress | None = None
    given: Given = NOTHING
    workers: int | None = None

    def bounded(self, law: FittableLaw) -> FittableLaw:
        """A law with the bounds that are given for its parameters."""
        return replace(law, parameters=self.given.bounded(law.parameters))


@dataclass(frozen=True)
class Estimator:
    """An estimator by name: what it assumes, how it reduces pooled logs to a problem and solves that, whether it
    takes the contact as rigid, whether it measures friction by inverse dynamics (which show nothing of spring, damping
    and drive), and roughly which shares of the time its searches take, one after the other."""

    name: str
    structure: tuple[str, ...]
    estimate: Callable[[Pool, FittableLaw, Options], Estimate]
    rigid: bool = True
    inverse: bool = False
    searches: tuple[float, ...] = (1.0,)


@dataclass(frozen=True, eq=False)
class Estimate:
    """A solved problem, the estimator that it is of (one that was to give first values only, if the later stages could
    not be finished), the law that was fitted, and what to warn of."""

    estimator: Estimator
    law: FittableLaw
    problem: FrictionProblem
    solution: Solution
    warnings: tuple[str, ...] = ()
