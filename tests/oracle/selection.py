"""Contact states by enumeration: rates and forces in given states, which states fit, and impulses of an impact.

held rows (stick, closed, sliding):  y' = 0;    the others: l by its law, or -sign mu l_N of a closed rigid contact
stick  -capacity_minus <= l <= capacity,  of a rigid contact |l_T| <= mu l_N;    slip  sign y' >= 0
closed l_N >= 0;    open  gap'' >= 0
impact: the same on the level of speeds, y' replaced by the speed after it (Newton: plus e times that before)
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from oracle.equations import FRICTION, NORMAL, SLIDER, STOP, SWITCH, TANGENT, Numbers, Terms
from scipy.optimize import linprog

HELD, AWAY, TOUCHING, RELEASED = 0, 9, 1, 2
Mode = tuple[int, ...]
RANK = 1e-10  # of the largest singular value of the held rows, scaled
FITS = 1e-9  # of the sizes of the terms


class UndeterminedError(Exception):
    """The laws do not say how the motion goes on, or in several ways."""


class Forces(NamedTuple):
    """Rates of the driven states and what comes with them, in one mode.

    margin: by held row of friction what its force lacks of its bounds, of a closed contact its force.
    """

    rates: Any
    force: Any  # (rows,)
    slip_rate: Any  # (rows,) y'
    margin: dict[int, float]
    size: Any  # (rows,) of the terms of y'
    residual: float


def forces(
    numbers: Numbers, mode: Mode, t: float, state: Any, entries: Mapping[int, float], x: Terms | None = None
) -> Forces:
    """Of a mode; see the module."""
    x = numbers.terms(t, state) if x is None else x
    rows = numbers.of.rows
    given, columns, held = np.zeros(len(rows)), x.W.copy(), []
    bounds: dict[int, tuple[float, float]] = {}
    for r, row in enumerate(rows):
        if mode[r] == AWAY or (row.kind == STOP and mode[r] == RELEASED) or row.kind == SLIDER:
            continue
        if row.kind == STOP:
            given[r] = numbers.of_row(r, t, state, x.y[r], 0, x.place[r], entries.get(r, 1.0))[0]
        elif mode[r] != HELD and row.kind in (FRICTION, SWITCH):
            given[r] = numbers.of_row(r, t, state, x.y[r], mode[r])[0]
        elif mode[r] != HELD:  # a rigid contact that slips
            mu = numbers.of_row(r, t, state, 0.0, mode[r])[3]
            columns[:, row.partner] -= mode[r] * mu * x.W[:, r]
        else:
            held.append(r)
            if row.kind in (FRICTION, SWITCH):
                _, plus, minus, *_ = numbers.of_row(r, t, state, 0.0, 0.0)
                bounds[r] = (-minus, plus)
    base = x.h + x.W @ given
    size_base = np.abs(x.h) + np.abs(x.W) @ np.abs(given)
    inverse = np.linalg.inv(x.M)
    free = inverse @ base
    size = np.abs(x.J) @ (np.abs(inverse) @ size_base) + np.abs(x.s) + 1e-300
    force, residual, margin = given.copy(), 0.0, {}
    if held:
        A = x.J[held] @ inverse @ columns[:, held]
        b = x.J[held] @ free + x.s[held]
        scale = np.sqrt(np.abs(np.diag(x.J[held] @ inverse @ x.J[held].T)) + 1e-300)
        scaled = A / scale[:, None] / scale
        left, singular, right = np.linalg.svd(scaled)
        used = singular > RANK * singular[0]
        pseudo = right[used].T @ ((left[:, used].T @ (-b / scale)) / singular[used])
        acting = pseudo / scale
        residual = float(np.max(np.abs(A @ acting + b) / size[held], initial=0.0))
        if not used.all():
            acting = _shared(numbers, held, bounds, A, b, acting, t, state)
        force[held] = acting
        free = free + inverse @ (columns[:, held] @ acting)
        for k, r in enumerate(held):
            row = rows[r]
            if row.kind == NORMAL:
                margin[r] = acting[k]
            elif row.kind == TANGENT:
                mu = numbers.of_row(r, t, state, 0.0, 0.0)[3]
                margin[r] = mu * acting[held.index(row.partner)] - abs(acting[k])
            elif row.kind == SWITCH and A[k, k] <= 0.0:
                margin[r] = -1.0  # repelling
            else:
                margin[r] = min(bounds[r][1] - acting[k], acting[k] - bounds[r][0])
    return Forces(free, force, x.J @ free + x.s, margin, size, residual)


def _shared(numbers: Numbers, held: list[int], bounds: Any, A: Any, b: Any, least: Any, t: float, state: Any) -> Any:
    """Forces of redundant contacts, those with the largest least margin; the motion is the same for all."""
    rows, n = numbers.of.rows, len(held)
    unequal, right = [], []
    for k, r in enumerate(held):
        sides = ((1.0, 1), (-1.0, 0)) if rows[r].kind != NORMAL else ((-1.0, 0),)
        for sign, at in sides:
            line = np.zeros(n + 1)
            line[k], line[n] = sign, 1.0
            if rows[r].kind == TANGENT:
                line[held.index(rows[r].partner)] -= numbers.of_row(r, t, state, 0.0, 0.0)[3]
            right.append(0.0 if r not in bounds else (bounds[r][1] if at else -bounds[r][0]))
            unequal.append(line)
    target = A @ least
    found = linprog(
        np.r_[np.zeros(n), -1.0], unequal, right, np.c_[A, np.zeros(n)], target, [(None, None)] * n + [(None, 1e6)]
    )
    return found.x[:n] if found.status == 0 else least


def fitting(
    numbers: Numbers, mode: Mode, options: Mapping[int, tuple[int, ...]], t: float, state: Any, entries: Any
) -> list[tuple[Mode, bool]]:
    """The modes among all combinations of ``options`` by row that fit at this instant, and whether some tie leaves that
    to what comes after it; those that hold most come first."""
    x, rows = numbers.terms(t, state), numbers.of.rows
    matches = []
    for choice in itertools.product(*options.values()):
        trial = list(mode)
        for r, c in zip(options, choice, strict=True):
            trial[r] = c
        if any(
            row.kind == TANGENT and (trial[r] == AWAY) != (trial[row.partner] == AWAY) for r, row in enumerate(rows)
        ):
            continue
        try:
            f = forces(numbers, tuple(trial), t, state, entries, x)
        except np.linalg.LinAlgError:
            continue
        if f.residual > 1e-7:
            continue
        fit, tie = True, False
        for r in options:
            row, choice_r = rows[r], trial[r]
            if choice_r == HELD:
                value, size = f.margin[r], max(np.abs(f.force).max(), 1e-12)
                if row.kind in (FRICTION, SWITCH):
                    # the force against its capacity
                    size = max(size, abs(numbers.of_row(r, t, state, 0.0, 0.0)[1]))
            elif choice_r == AWAY:
                if row.kind == TANGENT:
                    continue
                value, size = f.slip_rate[r], f.size[r]
            else:
                value, size = choice_r * f.slip_rate[r], f.size[r]
            fit = fit and value >= -FITS * size
            tie = tie or abs(value) <= FITS * size
        if fit:
            matches.append((tuple(trial), tie))
    return sorted(matches, key=lambda match: -sum(match[0][r] == HELD for r in options))


def impact(numbers: Numbers, touching: list[int], t: float, state: Any) -> Any:
    """Velocities after the impact of the rigid contacts ``touching`` (rows of normal directions)."""
    x, rows = numbers.terms(t, state), numbers.of.rows
    taking = [r for n in touching for r in (n, rows[n].partner) if r >= 0]
    coefficient = {r: numbers.of_row(r, t, state, 0.0, 0.0) for r in taking}
    inverse = np.linalg.inv(x.M)
    J = x.J[taking]
    G = J @ inverse @ J.T
    before = x.y[taking]
    mu = {taking.index(n): coefficient[n][3] for n in touching}
    e = {taking.index(n): coefficient[n][4] for n in touching}
    tangent = {taking.index(n): taking.index(rows[n].partner) for n in touching if rows[n].partner >= 0}
    kinds = {rows[n].poisson for n in touching}
    normals = [taking.index(n) for n in touching]
    none = np.zeros(len(taking))
    if not kinds or kinds == {False}:
        target = np.array([-e[k] * before[k] if k in e and before[k] < 0 else 0.0 for k in range(len(taking))])
        impulse = _phase(G, before, target, none, normals, tangent, mu)
    elif kinds == {True}:
        first = _phase(G, before, none, none, normals, tangent, mu)
        given = np.array([e.get(k, 0.0) * max(first[k], 0.0) for k in range(len(taking))])
        impulse = first + _phase(G, before + G @ first, none, given, normals, tangent, mu)
    else:
        raise UndeterminedError("both restitution rules in one impact")
    return inverse @ J.T @ impulse


def _phase(G: Any, before: Any, target: Any, given: Any, normals: list[int], tangent: Any, mu: Any) -> Any:
    """Impulses of one phase: 0 <= L - given, y+ >= target, one of them an equality; friction by Coulomb."""
    n, speed = len(before), max(float(np.abs(before).max()), 1e-300)
    choices = []
    for k in normals:
        slips = (None,) if k not in tangent else (0, 1, -1)
        choices.append(
            [(closed, s) for closed in (True, False) for s in (slips if closed or given[k] > 0 else slips[:1])]
        )
    matches = []
    for states in itertools.product(*choices):
        A, right = np.eye(n), np.zeros(n)
        for k, (closed, slip) in zip(normals, states, strict=True):
            if closed:
                A[k], right[k] = G[k], target[k] - before[k]
            else:
                right[k] = given[k]
            if k in tangent:
                m = tangent[k]
                if not closed and given[k] <= 0:
                    continue
                if slip == 0:
                    A[m], right[m] = G[m], -before[m]
                else:
                    A[m, k] = slip * mu[k]
        impulse = np.linalg.lstsq(A, right, rcond=1e-11)[0]
        after = before + G @ impulse
        if np.abs(A @ impulse - right).max() > 1e-8 * speed:
            continue
        unit = 1e-9 * max(float(np.abs(impulse).max()), 1e-300)
        fits = True
        for k, (closed, slip) in zip(normals, states, strict=True):
            fits &= impulse[k] >= given[k] - unit and after[k] >= target[k] - 1e-9 * speed
            if k in tangent and (closed or given[k] > 0):
                m = tangent[k]
                fits &= abs(impulse[m]) <= mu[k] * impulse[k] + unit
                fits &= slip == 0 or slip * after[m] >= -1e-9 * speed
        if fits:
            work = float(impulse @ (before + after)) / 2
            held = sum(closed + (slip == 0) for closed, slip in states)
            matches.append((work, held, impulse, after))
    if not matches:
        raise UndeterminedError("no impulses fit the laws")
    least = min(match[0] for match in matches)
    best = [m for m in matches if m[0] <= least + 1e-8 * abs(least)]
    most = max(match[1] for match in best)
    best = [match for match in best if match[1] == most]
    if max(float(np.abs(match[3] - best[0][3]).max()) for match in best) > 1e-7 * speed:
        raise UndeterminedError("several impulses fit the laws")
    return best[0][2]
