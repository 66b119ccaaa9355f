"""The woodpecker toy's mass matrix and contacts written out, and its impacts by trying all assignments: an oracle.

Newton:   after = before + G Lambda;   Lambda_N >= 0,  after_N >= -e before_N,  one of them an equality
Coulomb:  |Lambda_T| <= mu Lambda_N;  after_T = 0 where smaller, else Lambda_T against after_T
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

M_M, J_M, M_S, J_S, G, C_PHI, MU = 0.0003, 5.0e-9, 0.0045, 7.0e-7, 9.81, 0.0056, 0.3
R_0, R_M, H_M, L_M, L_G, H_S, L_S = 0.0025, 0.0031, 0.0058, 0.010, 0.015, 0.020, 0.0201

# angles at which the lower and the upper edge (-, +) and the beak meet the pole
SLEEVE = (R_M - R_0) / H_M
BEAK = (L_M + L_G - L_S - R_0) / H_S

MASS = np.array(
    [
        [M_M + M_S, M_S * L_M, M_S * L_G],
        [M_S * L_M, J_M + M_S * L_M**2, M_S * L_M * L_G],
        [M_S * L_G, M_S * L_M * L_G, J_S + M_S * L_G**2],
    ]
)
# per contact the directions of gap and slip, as in equation (22)
DIRECTIONS = {
    "beak": ((0.0, 0.0, -H_S), (1.0, L_M, L_G - L_S)),
    "lower": ((0.0, H_M, 0.0), (1.0, R_M, 0.0)),
    "upper": ((0.0, -H_M, 0.0), (1.0, R_M, 0.0)),
}


def matrix(*contacts: str) -> NDArray[np.float64]:
    """G of these contacts; rows and columns gap, slip, gap, slip, ..."""
    w = np.array([direction for contact in contacts for direction in DIRECTIONS[contact]])
    return w @ np.linalg.solve(MASS, w.T)


def impact(velocities: Sequence[float], restitution: Mapping[str, float]) -> tuple[NDArray[np.float64], float]:
    """(3,) velocities after an impact of the contacts named, and its work, J.

    Of several solutions the one that loses most energy.

    Raises:
        AssertionError: no impulses obey the laws.
    """
    w = np.array([direction for contact in restitution for direction in DIRECTIONS[contact]])
    g, before = w @ np.linalg.solve(MASS, w.T), w @ np.asarray(velocities)
    solutions = []
    for states in itertools.product(("open", "stick", 1, -1), repeat=len(restitution)):
        try:
            after, impulse = _assigned(g, before, states, list(restitution.values()))
        except np.linalg.LinAlgError:  # more rates prescribed than there are velocities
            continue
        if _obeys(after, impulse, before, list(restitution.values())):
            moved = np.asarray(velocities) + np.linalg.solve(MASS, w.T @ impulse)
            solutions.append((float(impulse @ (before + after)) / 2, moved))
    assert solutions
    work, moved = min(solutions, key=lambda solution: solution[0])
    return moved, work


def _assigned(
    g: NDArray[np.float64], before: NDArray[np.float64], states: Sequence[object], e: Sequence[float]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rates after the impact and impulses, from one linear equation per impulse."""
    n = len(before)
    rows, right = np.eye(n), np.zeros(n)
    for i, state in enumerate(states):
        normal, tangential = 2 * i, 2 * i + 1
        if state != "open":
            rows[normal], right[normal] = g[normal], -(1 + e[i]) * before[normal]
        if state == "stick":
            rows[tangential], right[tangential] = g[tangential], -before[tangential]
        elif state != "open":
            rows[tangential, normal] = MU * float(str(state))
    impulse = np.linalg.solve(rows, right)
    return np.asarray(before + g @ impulse, float), np.asarray(impulse, float)


def _obeys(
    after: NDArray[np.float64], impulse: NDArray[np.float64], before: NDArray[np.float64], e: Sequence[float]
) -> bool:
    speed, size = 1e-12 * np.abs(before).max(), 1e-12 * np.abs(impulse).max()
    for i in range(len(e)):
        normal, tangential = 2 * i, 2 * i + 1
        limit, friction = MU * impulse[normal], impulse[tangential]
        # beyond the cone neither holds: a rate of rounding's size is no slip, whichever its sign
        slips = abs(abs(friction) - limit) <= size and friction * after[tangential] <= speed * size
        sticks = abs(friction) <= limit + size and abs(after[tangential]) <= speed
        if impulse[normal] < -size or after[normal] < -e[i] * before[normal] - speed or not (slips or sticks):
            return False
    return True
