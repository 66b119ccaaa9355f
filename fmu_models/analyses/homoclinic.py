"""Where a motion leaves a saddle and comes back to it: the homoclinic point of a parameter.

    leave    along the one unstable eigenvector u, from beside the saddle
    arrive   where the motion passes, towards the saddle, the level of a state that lies at a distance from the saddle
             on its slowest stable eigenvector
    leave    again: it follows u to one side or to the other, since it has missed the stable manifold on that side
    halve    the range of the parameter between two values whose motions leave to different sides, down to rounding

How far the arrival is from the saddle does not matter: what is halved is on which side of the stable manifold it is,
not by how much, which the bend of that manifold would falsify. Only the unstable manifold is followed, by the engine,
so that events on the way do no harm; it must be a curve. The sum of the two eigenvalues says what is born there: a
stable cycle where it is negative, an unstable one where positive.

Source: Kuznetsov, Elements of Applied Bifurcation Theory (2004), section 6.2, theorems 6.1 and 6.4.
"""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice, pairwise, product
from typing import Any, ClassVar

import numpy as np

from fmu_models.analyses.saddle import Saddle, saddle_of
from fmu_models.base.arrays import Complex, Vector
from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Pictured
from fmu_models.continuation.problem.problem import range_of
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sections import Section, SectionFollower, SectionPoint

# distances in sizes of the states: of the begin from the saddle, and of places of arrival that are tried
BESIDE = 1e-7
ARRIVALS = (0.1, 0.03, 0.3, 0.01)
# values over the range that are looked at first, passages of the place of arrival, halvings of the range
VALUES, PASSAGES, HALVINGS = 17, 6, 120
# growth of a motion on its way round, in powers of e of the slower eigenvalue, and of what is left of rounding
GROWTH, LEAVES = 40.0, 45.0
SAMPLES = 2001


@dataclass(frozen=True, eq=False)
class Homoclinic(Pictured):
    """A motion from a saddle to itself.

    Attributes:
        model, parameter, value: name of the model, name and value of the parameter.
        states: names.
        saddle: (n,) the equilibrium.
        eigenvalues: (n,) its, by falling real part, 1/s.
        width: of the range that is left.
        times, points: (m,) s, (m, n) of the motion, from beside the saddle to where it has come back.
    """

    COLUMNS: ClassVar = ("[time]=times", "{states}=points")
    RECORD: ClassVar = ("model", "parameter", "value", "width", "states", "saddle", "eigenvalues", "saddle_quantity")

    model: str
    parameter: str
    value: float
    states: tuple[str, ...]
    saddle: Vector
    eigenvalues: Complex
    width: float
    times: Vector
    points: Vector

    @property
    def saddle_quantity(self) -> float:
        """Sum of the eigenvalues next to the imaginary axis: negative where a stable cycle is born, 1/s."""
        real = self.eigenvalues.real
        return float(real[real > 0.0].min() + real[real < 0.0].max())

    @property
    def born(self) -> str:
        """What is born there, in words; where the saddle quantity is zero what happens on the way decides."""
        if abs(self.saddle_quantity) < 1e-9 * np.abs(self.eigenvalues).max():
            return "a cycle"
        return "a stable cycle" if self.saddle_quantity < 0.0 else "an unstable cycle"

    def _heading(self) -> str:
        return f"Homoclinic point of {self.model} at {self.parameter} = {self.value:.15g}"

    def _contents(self) -> Mapping[str, Any]:
        return {"saddle": self.saddle, "eigenvalues": self.eigenvalues, "born there": self.born}


def homoclinic(
    fmu: Fmu,
    over: str,
    between: tuple[float, float],
    *,
    start: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
) -> Homoclinic:
    """The value of a parameter at which the saddle near a start has a motion to itself.

    Args:
        fmu: of this suite.
        over: name of a parameter or input.
        between: its least and largest value, with one such value between them.
        start: states near the saddle, at the middle of the range.
        parameters: values of parameters and inputs that are not at their default.

    Raises:
        StickslipError: as ``saddle_of``; more than one direction to leave along, or no such value in the range.
    """
    low, high = range_of(over, between)
    saddle = saddle_of(fmu, dict(start or {}), {**(parameters or {}), over: (low + high) / 2})
    if len(saddle.unstable) != 1 or (saddle.values.real > 0.0).sum() != 1:
        raise StickslipError(
            f"The saddle of '{saddle.name}' has {(saddle.values.real > 0.0).sum()} directions along which motions "
            "leave; with one of them alone the motion that leaves is known."
        )
    for distance, out, arrival in product(ARRIVALS, (1.0, -1.0), (1.0, -1.0)):
        side = _Side(saddle, over, out, arrival, distance)
        bracket = side.bracket(np.linspace(low, high, VALUES))
        if bracket is not None:
            return _told(side, *side.halved(*bracket))
    raise StickslipError(
        f"No motion of '{saddle.name}' from that saddle comes back to it for {over} between {low:g} and {high:g}. Try "
        "another range, or look at the manifolds on both sides."
    )


@dataclass(frozen=True, eq=False)
class _Side:
    """To which side the motion that leaves a saddle leaves it again.

    Args:
        saddle: at some value of the parameter; it is followed from there.
        out, back: sides of the eigenvectors along which the motion leaves and arrives.
        distance: of the place of arrival, in sizes of the states.
    """

    saddle: Saddle
    over: str
    out: float
    back: float
    distance: float

    def __call__(self, value: float) -> float:
        """1 or -1; nan where the motion does not come by, 0 where it stays as far as can be seen."""
        try:
            saddle = self.saddle.at(**{self.over: value})
        except StickslipError:
            return np.nan
        times, points = self.arrivals(saddle)
        if not len(times):
            return np.nan
        unstable = saddle.unstable[0]
        left_vectors, rate = saddle.left(unstable), float(saddle.values[unstable].real)
        nearest = points[np.abs((points - saddle.point) @ left_vectors).argmin()]
        at = np.linspace(0.0, LEAVES / rate, SAMPLES)
        offset = (nearest - saddle.point)[None] @ left_vectors
        for share in (0.1, 0.3, 1.0):  # the rest of the way may go to infinity
            try:
                run = simulate(saddle.fmu, share * float(at[-1]), output_times=share * at, **saddle.as_run(nearest))
            except StickslipError:
                break
            motion = np.column_stack([run[name] for name in saddle.fmu.states])
            offset = (motion - saddle.point) @ left_vectors
            if np.abs(offset).max() > self.distance:
                break
        leaves = np.abs(offset) > self.distance
        return float(np.sign(offset[leaves.argmax()])) if leaves.any() else 0.0

    def arrivals(self, saddle: Saddle) -> tuple[Vector, Vector]:
        """(m,) s and (m, n) where the motion passes the place of arrival."""
        slow = saddle.direction(saddle.stable[0])
        i = int(np.abs(slow).argmax())
        step = self.back * self.distance * slow[i] * saddle.sizes[i]
        departure = saddle.point + self.out * BESIDE * saddle.direction(saddle.unstable[0]) * saddle.sizes
        slower = min(abs(saddle.values[k].real) for k in (saddle.unstable[0], saddle.stable[0]))
        run = saddle.as_run(departure)
        section = Section(saddle.fmu.states[i], float(saddle.point[i] + step), -int(np.sign(step)))
        follower = SectionFollower(saddle.fmu, section, parameters=run["parameters"], inputs=run["inputs"])
        passages: list[SectionPoint] = []
        with suppress(StickslipError):  # later it may go to infinity
            for passage in islice(follower.follow(run["start"], GROWTH / slower), PASSAGES):
                passages.append(passage)
        times = np.array([point.time for point in passages])
        points = np.array([[*point.states.values()] for point in passages]).reshape(-1, len(departure))
        # those alone that come from the side of the stable eigenvector, not across the unstable one
        close = np.abs((points - saddle.point) @ saddle.left(saddle.unstable[0])) < 3.0 * self.distance
        return times[close], points[close]

    def bracket(self, values: Vector) -> tuple[float, float] | None:
        """Two values from which the motion leaves to different sides, first -1."""
        misses = [(value, self(value)) for value in values.tolist()]
        for first, second in pairwise(misses):
            if first[1] * second[1] <= 0.0:
                return (first[0], second[0]) if first[1] < second[1] else (second[0], first[0])
            if np.isnan(first[1]) != np.isnan(second[1]):
                bracket = self._beside(*((*first, second[0]) if np.isnan(second[1]) else (*second, first[0])))
                if bracket is not None:
                    return bracket
        return None

    def _beside(self, defined: float, side: float, beyond: float) -> tuple[float, float] | None:
        """The same between a value and one at which the motion does not come by: it still does so where it misses the
        saddle by little on the other side."""
        for _ in range(HALVINGS):
            middle = (defined + beyond) / 2.0
            if middle in (defined, beyond):
                break
            miss = self(middle)
            if miss * side <= 0.0:
                return (defined, middle) if side < 0.0 else (middle, defined)
            defined, beyond = (defined, middle) if np.isnan(miss) else (middle, beyond)
        return None

    def halved(self, minus: float, plus: float) -> tuple[float, float]:
        """Until nothing but rounding lies between."""
        for _ in range(HALVINGS):
            middle = (minus + plus) / 2.0
            miss = self(middle)
            if middle in (minus, plus) or miss == 0.0 or np.isnan(miss):
                break
            minus, plus = (middle, plus) if miss < 0.0 else (minus, middle)
        return (minus + plus) / 2.0, abs(plus - minus)


def _told(side: _Side, value: float, width: float) -> Homoclinic:
    saddle = side.saddle.at(**{side.over: value})
    times, points = side.arrivals(saddle)
    nearest = int(np.abs((points - saddle.point) @ saddle.left(saddle.unstable[0])).argmin())
    departure = saddle.point + side.out * BESIDE * saddle.direction(saddle.unstable[0]) * saddle.sizes
    at = np.linspace(0.0, float(times[nearest]), SAMPLES)
    run = simulate(saddle.fmu, float(at[-1]), output_times=at, **saddle.as_run(departure))
    motion = np.column_stack([run[name] for name in saddle.fmu.states])
    names = tuple(saddle.fmu.states)
    return Homoclinic(saddle.name, side.over, value, names, saddle.point, saddle.values, width, run.time, motion)
