"""Smoothing: every jump of the right-hand side becomes a steep slope of a given width.

    sgn(y)                    shape(y/width)                          friction, switches
    stop at depth > 0         F (1 + shape(depth/width))/2            and, if it lets go by force, once more with F

    tanh      shape(r) = tanh(r)
    arctan    shape(r) = 2/pi atan(r)

A smoothed contact never sticks, it creeps; the equations are stiff as 1/width. Its error has a part that no tolerance
reaches: that of the width. Velocities that jump (rigid contacts) cannot be smoothed.

Source: Van de Vrande, van Campen, de Kraker, An approximate analysis of dry-friction-induced stick-slip vibrations by a
smoothing procedure, Nonlinear Dynamics 19 (1999), for arctan.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, final

import sympy
from scipy.integrate import solve_ivp

from fmu_models.language.contact_dynamics import ContactDynamics
from fmu_models.validation.methods.equations import Equations
from fmu_models.validation.methods.result import MethodProblem, MethodRun, NotTreated, needs_steady_inputs, timed
from fmu_models.validation.methods.sides import Sides

SHAPES: dict[str, Callable[[Any], Any]] = {
    "tanh": lambda r: sympy.tanh(r),
    "arctan": lambda r: 2 / sympy.pi * sympy.atan(r),
}
FINEST = 2.3e-14


@final
@dataclass(frozen=True)
class Smoothing:
    """``width`` in the unit of each boundary (m, m/s, N); ``solver`` of scipy's solve_ivp."""

    shape: Literal["tanh", "arctan"] = "tanh"
    width: float = 1e-3
    solver: Literal["LSODA", "Radau", "RK45", "DOP853"] = "LSODA"
    tolerances: tuple[float, ...] = (1e-6, 1e-8, 1e-10)
    family: Literal["smoothing"] = "smoothing"

    @property
    def name(self) -> str:
        return f"{self.shape} {self.width:g}, {self.solver}"

    def prepare(self, problem: MethodProblem) -> Callable[[float], MethodRun]:
        """Compile the smoothed field."""
        needs_steady_inputs(problem, self.name)
        equations = Equations(problem.system)
        field = equations.function(self._rates(equations))
        sides = Sides(equations)
        seen = not any(c.sticks or (c.depth is not None and c.kind.rubs) for c in equations.contacts)

        def make(tolerance: float) -> MethodRun:
            def once() -> tuple[Any, tuple | None, int]:
                solution = solve_ivp(
                    lambda t, z: field(t, z.tolist()),
                    *((0.0, problem.stop_time), equations.start(problem.start)),
                    method=self.solver, rtol=max(tolerance, FINEST), atol=tolerance * problem.nominal,
                    dense_output=seen,
                )  # fmt: skip
                if solution.status < 0:
                    raise NotTreated(f"{self.solver} stopped at {solution.t[-1]:g} s: {solution.message}")
                if not seen:
                    return solution.y[:, -1], None, solution.nfev
                sides.begin(0.0, solution.y[:, 0])
                for t0, t1 in zip(solution.t, solution.t[1:], strict=False):
                    sides.step(float(t0), float(t1), solution.sol)
                return solution.y[:, -1], tuple(sides.switches), solution.nfev

            return timed(once, equations.n)

        return make

    def _rates(self, equations: Equations) -> tuple[Any, ...]:
        """The smoothed right-hand side, as expressions."""
        shape = SHAPES[self.shape]
        system = equations.system
        width = sympy.Float(self.width)
        signs = {c.sign_symbol: shape(c.slip / width) for c in system.contacts if c.kind.dry}
        forces = []
        for contact in system.contacts:
            self._check(contact)
            force = sympy.S.Zero if contact.kind.surface and not contact.sticks else contact.force
            force = equations.place(force, signs)
            # a force may only be cut off where its law is continued: a stop pulls beyond its boundary
            for edge in (contact.depth, contact.release):
                if edge is not None:
                    force *= (1 + shape(equations.place(edge, signs) / width)) / 2
            forces.append(force)
        return equations.rates_under(forces, signs)

    def _check(self, contact: ContactDynamics) -> None:
        if contact.kind.rigid:
            raise NotTreated(
                f"'{contact.name}' is rigid: velocities jump there, which no smooth right-hand side does. "
                "Use event-driven Taylor or Moreau time-stepping, or model a compliant stop."
            )
        if contact.reset:
            raise NotTreated(f"'{contact.name}': states jump, which cannot be smoothed. Use event-driven Taylor.")
        if contact.remembers:
            raise NotTreated(
                f"'{contact.name}': the force knows the speed of entry, which a smooth field does not. "
                "Use event-driven Taylor or scipy with events."
            )
