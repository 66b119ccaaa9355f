"""A pendulum of n point masses on massless links, declared by its energies; and its closed form, as an oracle.

    sum_j mu_max(i,j) l_i l_j (cos(q_i - q_j) q_j'' + sin(q_i - q_j) q_j'^2) = -g mu_i l_i sin q_i + Q_i
    mu_i = m_i + ... + m_n

Angles are from the vertical. Source: Calvao and Penna, European Journal of Physics 36 (2015), equation (7) for equal
masses and lengths.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import sympy

from fmu_models.language.contacts import Contact
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Parameter

GRAVITY = 9.81


def lengths(n: int) -> np.ndarray:
    """Of the links, m."""
    return 0.6 - 0.3 * np.arange(n) / n


def masses(n: int) -> np.ndarray:
    """Of the bobs, kg."""
    return 1.0 + 0.5 * np.cos(np.arange(n))


def angles(n: int) -> list[Coordinate]:
    """The coordinates, at their starts."""
    return [
        Coordinate(f"q{i}", "rad", f"angle of link {i}", velocity=f"w{i}", start=0.9 - 0.15 * i, v_start=0.2)
        for i in range(n)
    ]


def pendulum(q: Sequence[Coordinate], contacts: Sequence[Contact] = ()) -> Mechanism:
    """The pendulum on these coordinates."""
    n = len(q)
    m = [Parameter(f"m{i}", value, "kg", f"mass of bob {i}", positive=True) for i, value in enumerate(masses(n))]
    length = [Parameter(f"l{i}", value, "m", f"length {i}", positive=True) for i, value in enumerate(lengths(n))]
    g = Parameter("g", GRAVITY, "m/s2", "gravity")
    kinetic, potential = [], []
    across, along, height = sympy.S.Zero, sympy.S.Zero, sympy.S.Zero
    for i, x in enumerate(q):
        across += length[i] * sympy.cos(x) * x.v
        along += length[i] * sympy.sin(x) * x.v
        height -= length[i] * sympy.cos(x)
        kinetic.append(m[i] * (across**2 + along**2) / 2)
        potential.append(m[i] * g * height)
    return Mechanism(
        name=f"pendulum_of_{n}",
        title="pendulum of point masses",
        source="test",
        coordinates=q,
        kinetic_energy=sympy.Add(*kinetic),
        potential_energy=sympy.Add(*potential),
        contacts=contacts,
    )


def mass_matrix(q: np.ndarray) -> np.ndarray:
    """M, (n, n)."""
    n = len(q)
    beyond = np.cumsum(masses(n)[::-1])[::-1]
    return (
        beyond[np.maximum.outer(np.arange(n), np.arange(n))]
        * np.outer(lengths(n), lengths(n))
        * np.cos(np.subtract.outer(q, q))
    )


def acceleration(q: np.ndarray, w: np.ndarray, torque: np.ndarray | float = 0.0) -> np.ndarray:
    """q'', (n,), under generalised forces."""
    n = len(q)
    beyond = np.cumsum(masses(n)[::-1])[::-1]
    both = beyond[np.maximum.outer(np.arange(n), np.arange(n))] * np.outer(lengths(n), lengths(n))
    drag = both * np.sin(np.subtract.outer(q, q)) @ w**2
    return np.linalg.solve(mass_matrix(q), torque - drag - GRAVITY * beyond * lengths(n) * np.sin(q))


def energy(q: np.ndarray, w: np.ndarray) -> float:
    """T + U, J."""
    n = len(q)
    return float(w @ mass_matrix(q) @ w / 2 - GRAVITY * np.cumsum(lengths(n) * np.cos(q)) @ masses(n))
