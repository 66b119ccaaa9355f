"""What a branch of somebody else's FMU is followed of: the periodic motions of a strobe, stepped by the importer.

Derivatives by the states are those of the strobe, by the FMU's directional derivatives where it offers them; those by
the parameter are differences of motions. Events are those of indicators; a miss is the least value of an indicator that
has a minimum between events, its gradient by differences of motions too, on one side where a neighbour has the event.
How near motions are is measured, by one of ten times the tolerance.
"""

import copy
from dataclasses import dataclass

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.continuation.problem.flow import FlowProblem
from fmu_models.continuation.problem.problem import SAME_TIME, Passing, Problem, Seen, Vector
from fmu_models.importer.flow import Flow
from fmu_models.sections.strobe import Strobe

# the state of a contact of which nothing is known but that its indicator passes zero: its sign after an event may be
# rounding
PASSED = 1
CHANGE = 1e-4  # of a parameter, for a central difference, which loses two thirds of the digits
COARSER = 10.0  # times the tolerance, for the motion that shows how near another one is


def indicator(i: int) -> str:
    """What an event indicator is called, by its number from 0."""
    return f"indicator {i + 1}"


@dataclass(frozen=True, eq=False)
class ImportedProblem(FlowProblem):
    """Of an FMU of others: see the module."""

    def _at(self, z: Vector) -> Strobe:
        """The strobe of the motion at z."""
        strobe = self.strobe.at(**self.values(z))
        if self.autonomous:
            strobe = copy.copy(strobe)
            strobe.period = self.length(z)
        return strobe

    def see(self, z: Vector) -> Seen:
        n = len(self.states)
        strobe, x = self._at(z), z[:n]
        step = strobe.step(x[None])
        if step.why:
            raise StickslipError(next(iter(step.why.values())))
        by_values = []
        for name, value in self.values(z).items():
            change = CHANGE * (abs(value) or 1.0)
            sides = strobe.step(np.array([x, x]), {name: np.array([value + change, value - change])}, derivative=False)
            by_values.append((sides.points[0] - sides.points[1]) / (2.0 * change))
        monodromy, residual = step.derivatives[0], step.points[0] - x
        columns = [monodromy - np.eye(n), *by_values]
        if self.autonomous:
            start, end = strobe.along(np.array([x, step.points[0]]))
            columns.insert(len(columns) - 1, end)
            jacobian = np.vstack([np.column_stack(columns), np.append(start, np.zeros(self.size - n))])
            residual = np.append(residual, 0.0)
        else:
            jacobian = np.column_stack(columns)
        flow = strobe.flow(x)
        word = tuple((indicator(i), PASSED, PASSED) for i in flow.events)

        def passings() -> tuple[tuple[Passing, ...], tuple[Passing, ...]]:
            candidates = (self._miss(z, int(i), flow) for i in np.flatnonzero(np.isfinite(flow.misses[:, 0])))
            return (), tuple(miss for miss in candidates if miss is not None)

        return Seen(residual, jacobian, monodromy, float(step.times[0]), word, passings)

    def _miss(self, z: Vector, i: int, flow: Flow) -> Passing | None:
        """With its gradient; None if neighbours on both sides lose it."""
        value, time = flow.misses[i].tolist()
        sizes = np.append(np.maximum(np.abs(z[:-1]), 1.0), abs(z[-1]) or 1.0) * CHANGE

        def beside(j: int, steps: float) -> float:
            moved = z.copy()
            moved[j] += steps * sizes[j]
            least = self._at(moved).flow(moved[: len(self.states)]).misses[i]
            return float(least[0]) if abs(least[1] - time) < SAME_TIME * self.length(z) else np.nan

        gradient = np.zeros_like(z)
        for j in range(len(z)):
            up, down = beside(j, 1.0), beside(j, -1.0)
            slopes = [(up - down) / 2.0]
            if not np.isfinite(slopes[0]):
                sides = (1, up), (-1, down)
                slopes = [s * (4.0 * least - beside(j, 2.0 * s) - 3.0 * value) / 2.0 for s, least in sides]
            finite = [slope for slope in slopes if np.isfinite(slope)]
            if not finite:
                return None
            gradient[j] = finite[0] / sizes[j]
        return Passing(indicator(i), 0, 0, PASSED, PASSED, time, value, gradient)

    @property
    def divisible(self) -> bool:
        return False

    def rephased(self, z: Vector, seen: Seen, scales: Vector) -> tuple[Problem, Vector] | None:
        return None

    def _state(self, z: Vector, later: float) -> Vector:
        moved = self._at(z).trajectory(z[: len(self.states)], np.array([later]))
        return np.array([float(moved[name][0]) for name in self.states])

    def how(self, z: Vector, seen: Seen) -> str:
        """Where motions and derivatives come from, and how near they are at z."""
        n = len(self.states)
        strobe = copy.copy(self._at(z))
        strobe.tolerance = COARSER * strobe.tolerance
        coarse = strobe.folded(1).step(z[None, :n])
        matrix = seen.jacobian[:, : n + self.autonomous]
        missed = np.append(coarse.points[0] - z[:n] - seen.residual[:n], np.zeros(int(self.autonomous)))
        state = np.abs(np.linalg.solve(matrix, missed)).max()
        spectra = self.multipliers(coarse.derivatives[0]), self.multipliers(seen.monodromy)
        multiplier = max(abs(coarse_multiplier - spectra[1]).min() for coarse_multiplier in spectra[0])
        return (
            f"{self.strobe.how}; by the parameter by differences of motions; at the start motions are within "
            f"{max(state, 1e-15):.1g}, multipliers within {max(multiplier, 1e-15):.1g}; where events come or go "
            "is located by the least value of their indicators"
        )
