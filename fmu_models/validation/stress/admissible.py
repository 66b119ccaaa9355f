"""Whether the contact states of a run are possible where the run says they are.

friction      slip: the slip speed has its sign, lambda is the law's; stick: no slip, lambda within its bounds
stop          away: not inside; touching: inside, F is the law's; released: inside without force
impact        open: gap >= 0; closed: gap = 0 and lambda >= 0
its friction  slip: |lambda| = mu lambda_N; stick: no slip, |lambda| <= mu lambda_N
switch        on the side that it says; sliding: h = 0
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fmu_models.language.contact_kinds import AWAY, CHATTERING, RELEASED, SLIP_MINUS, SLIP_PLUS, STICK, TOUCHING
from fmu_models.validation.stress.equations import NUDGE, ROUNDINGS, Columns, StressEquations, StressFindings


def contradictions(equations: StressEquations, columns: Columns, parameters: Mapping[str, float]) -> StressFindings:
    """The largest contradiction between contact states and what they say, relative; 0 if there is none."""
    worst = StressFindings(0.0, "")
    with np.errstate(all="ignore"):
        values = equations.environment(columns, parameters)
        moved = equations.environment(equations.nudged(columns), parameters)
        gross = equations.gross(columns, parameters)
        for i, contact in enumerate(equations.system.contacts):
            for description, wrong in _Contact(equations, i, columns, (values, moved), gross[i]).violations():
                wrong = np.where(np.isfinite(wrong), wrong, 0.0)
                if wrong.size and wrong.max() > worst.error:
                    worst = StressFindings(float(wrong.max()), f"{contact.name}: {description}")
    return worst


class _Contact:
    """One contact at all samples."""

    def __init__(
        self,
        equations: StressEquations,
        i: int,
        columns: Columns,
        values: tuple[list[Any], list[Any]],
        gross: tuple[float, float],
    ) -> None:
        self.contact = equations.system.contacts[i]
        self.equations, self.i, self.columns = equations, i, columns
        self.values, self.moved = values
        self.gross_speed, gross_force = gross
        self.force_rounding = ROUNDINGS * gross_force
        self.state = columns[f"{self.contact.name}_state"]

    def violations(self) -> list[tuple[str, NDArray]]:
        """What is wrong, and by how much relative to its own scale (n,); negative where nothing is."""
        kind = self.contact.kind
        if kind.normal:
            return self._impact() if kind.rigid else self._stop()
        if kind.rigid:
            return self._rigid_friction()
        return self._switch() if kind.surface else self._friction()

    def _relative(self, quantity: str) -> NDArray:
        """Slip or depth over the magnitude of its terms along the run, drawn to zero by rounding."""
        value, size = self.equations.place(self.i, self.values, quantity)
        moved, _ = self.equations.place(self.i, self.moved, quantity)
        value, size = np.broadcast_to(value, self.state.shape), np.broadcast_to(size, self.state.shape)
        rounding = np.abs(moved - value) / NUDGE * ROUNDINGS
        scale = float(np.nanmax(size)) if np.isfinite(size).any() else 0.0
        if quantity == "slip" and not self.contact.kind.surface:
            rounding = rounding + ROUNDINGS * self.gross_speed
        return np.sign(value) * np.maximum(np.abs(value) - rounding, 0.0) / (scale if scale > 0 else 1.0)

    def _where(self, states: tuple[int, ...], wrong: NDArray) -> NDArray:
        return np.where(np.isin(self.state, states), wrong, 0.0)

    def _law(self, states: tuple[int, ...]) -> NDArray:
        """Reported force against the law's."""
        law = np.broadcast_to(self.equations.laws(self.i, self.values)[0], self.state.shape)
        moved = np.broadcast_to(self.equations.laws(self.i, self.moved)[0], self.state.shape)
        force = -self.columns[f"{self.contact.name}_force"]
        rounding = np.abs(moved - law) / NUDGE * ROUNDINGS
        size = np.maximum(np.abs(law), np.abs(force))
        return self._where(states, (np.abs(force - law) - rounding) / np.where(size > 0, size, 1.0))

    def _capacity(self, plus: ArrayLike, minus: ArrayLike) -> NDArray:
        """By how much a force in stick exceeds what holds it, for either sign of lambda."""
        reported = -self.columns[f"{self.contact.name}_force"]
        force, capacity = np.abs(reported), np.where(reported > 0, plus, minus)
        size = np.maximum(force, np.abs(capacity))
        excess = force - capacity
        return np.sign(excess) * np.maximum(np.abs(excess) - self.force_rounding, 0.0) / np.where(size > 0, size, 1.0)

    def _pulls(self, force: NDArray) -> NDArray:
        """By how much a contact pulls that can only push."""
        size = float(np.abs(force).max())
        return self._where((TOUCHING,), np.maximum(-force - self.force_rounding, 0.0) / (size if size > 0 else 1.0))

    def _friction(self) -> list[tuple[str, NDArray]]:
        slip = self._relative("slip")
        capacities = self.equations.capacities(self.i, self.values)
        violations = [
            ("slip speed below zero in slip+", self._where((SLIP_PLUS,), -slip)),
            ("slip speed above zero in slip-", self._where((SLIP_MINUS,), slip)),
            ("force not of the law in slip", self._law((SLIP_MINUS, SLIP_PLUS))),
        ]
        if self.contact.sticks:
            violations.append(("slip speed in stick", self._where((STICK,), np.abs(slip))))
            violations.append(
                ("force beyond the capacity in stick", self._where((STICK,), self._capacity(*capacities)))
            )
        if self.contact.depth is not None:
            inside = self._relative("depth")
            violations.append(("outside its region", self._where((SLIP_MINUS, STICK, SLIP_PLUS), -inside)))
            violations.append(("away inside its region", self._where((AWAY,), inside)))
        return violations

    def _stop(self) -> list[tuple[str, NDArray]]:
        inside = self._relative("depth")
        force = self.columns[f"{self.contact.name}_force"]
        violations = [
            ("away although inside", self._where((AWAY,), inside)),
            ("touching although outside", self._where((TOUCHING, RELEASED), -inside)),
            ("force not of the law", self._law((TOUCHING,))),
        ]
        if self.contact.release is not None:
            violations.append(("pulls", self._pulls(force)))
        return violations

    def _impact(self) -> list[tuple[str, NDArray]]:
        depth = self._relative("depth")
        force = self.columns[f"{self.contact.name}_force"]
        return [
            ("wall penetrated", self._where((AWAY, CHATTERING), depth)),
            ("closed off the wall", self._where((TOUCHING,), np.abs(depth))),
            ("pulls", self._pulls(force)),
        ]

    def _rigid_friction(self) -> list[tuple[str, NDArray]]:
        slip = self._relative("slip")
        partner = self.equations.system.contacts[self.contact.partner or 0]
        mu = self.equations.laws(self.i, self.values)[1]
        limit = mu * np.maximum(self.columns[f"{partner.name}_force"], 0.0)
        excess = self._capacity(limit, limit)
        return [
            ("slip speed below zero in slip+", self._where((SLIP_PLUS,), -slip)),
            ("slip speed above zero in slip-", self._where((SLIP_MINUS,), slip)),
            ("force not mu times the load in slip", self._where((SLIP_MINUS, SLIP_PLUS), np.abs(excess))),
            ("slip speed in stick", self._where((STICK,), np.abs(slip))),
            ("force beyond mu times the load in stick", self._where((STICK,), excess)),
        ]

    def _switch(self) -> list[tuple[str, NDArray]]:
        h = self._relative("slip")
        return [
            ("on the side minus in +", self._where((SLIP_PLUS,), -h)),
            ("on the side plus in -", self._where((SLIP_MINUS,), h)),
            ("off the surface in sliding", self._where((STICK,), np.abs(h))),
        ]
