"""Whether a bifurcation is super- or subcritical, from the cubic term of its normal form.

With A the monodromy matrix of the map x -> P(x) of the strobe, B and C its second and third derivatives, A q = mu q,
A' p = conj(mu) p, |q| = 1, <p, q> = 1, <.,.> conjugating its first argument:

    flip           c = 1/6 <p, C(q, q, q)> + 1/2 <p, B(q, (1 - A)^-1 B(q, q))>      x -> -x + c x^3, supercritical c > 0
    pitchfork      the same, the inverse taken across q                           x -> x + c x^3, supercritical c < 0
    Neimark-Sacker l1 = 1/2 Re(conj(mu) (<p, C(q, q, q*)> + 2 <p, B(q, (1 - A)^-1 B(q, q*))>
                        + <p, B(q*, (mu^2 - A)^-1 B(q, q))>))                      supercritical l1 < 0

A run gives A exactly; B and C are central differences of it, of two widths, extrapolated, which tell the error too; it
is not below that of rounding, which third differences magnify. A coefficient that is not above its error has no sign:
at mu = 0 van der Pol's equation is linear, all its motions are cycles, and l1 = 0. Of an equilibrium, with A the
derivative of the rates, A q = i omega q:

    Hopf           l1 = 1/(2 omega) Re(<p, C(q, q, q*)> - 2 <p, B(q, A^-1 B(q, q*))>
                        + <p, B(q*, (2 i omega - A)^-1 B(q, q))>)               supercritical l1 < 0

Source: Kuznetsov, Elements of Applied Bifurcation Theory (2004), sections 3.5, 5.4.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fmu_models.continuation.problem.flow import FlowProblem
from fmu_models.continuation.problem.node import Lost, Node, look
from fmu_models.continuation.problem.problem import Problem, Vector, cyclic
from fmu_models.continuation.special.kinds import KINDS

# differences, in scales of the states: the first at which no event comes or goes, and two widths agree as well as that
WIDTHS, AGREE = (1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 1e-6), 0.05
# in inverse squares of the scale of the states
LEAST = 1e-2
EPSILON = float(np.finfo(float).eps)
UNDECIDED = "degenerate or undecided"  # what is said where a coefficient may vanish


class Coefficient(NamedTuple):
    """A cubic coefficient and its error."""

    value: float
    error: float


class _Cubic(NamedTuple):
    """A coefficient, and the vectors p, with the factor of <p, C(q, q, q)>, and q that it is of."""

    value: float
    p: NDArray[Any]
    q: NDArray[Any]


UNKNOWN = Coefficient(np.nan, np.nan)


def coefficient(kind: str, node: Node) -> Coefficient:
    """The cubic coefficient of a flip, a pitchfork (c), a Neimark-Sacker or a Hopf point (l1), states at phase 0 in
    their units; nan where it is not known: no event may begin at once, and the motion must be forced or still.

    Args:
        kind: of an equilibrium or of its motion over a short time a Hopf point.
        node: the motion there.
    """
    passes, still = KINDS[kind].passes, node.problem.still and KINDS[kind].passes == "circle"
    problem, z = (node.problem, node.z) if still else _at_zero(node)
    if problem.autonomous:
        return UNKNOWN
    # where it vanishes two widths do not agree in parts of it
    least = LEAST / float(node.scales[: len(problem.states)].max()) ** 2 if still else 0.0
    return _settled(problem, z, node.scales, partial(_projected, passes, still), least)


def _settled(
    problem: Problem, z: Vector, scales: Vector, of: Callable[[Vector, Vector, Vector], _Cubic | None], least: float
) -> Coefficient:
    """A function of the derivatives, of the first differences of two widths that agree, in parts of the value or of the
    least one that counts."""
    n = len(problem.states)
    for width in WIDTHS:
        widths = width * scales[:n]
        try:
            derivatives, wider = (_derivatives(problem, z, share * widths) for share in (1.0, 2.0))
        except Lost:
            continue
        narrow, wide = of(*derivatives), of(*wider)
        if narrow is None or wide is None:
            return UNKNOWN
        difference = abs(wide.value - narrow.value)
        if difference <= AGREE * max(abs(narrow.value), least):
            error = max(difference / AGREE, _rounding(derivatives[0], narrow, widths))
            return Coefficient((4.0 * narrow.value - wide.value) / 3.0, error)
    return UNKNOWN


def _rounding(a: Vector, cubic: _Cubic, widths: Vector) -> float:
    """Of a coefficient: four numbers as large as those of A make a third derivative."""
    largest = float((np.abs(a) * widths / widths[:, None]).max())
    return float(4.0 * EPSILON * largest * (np.abs(cubic.p) @ widths) * (np.abs(cubic.q) / widths).sum() ** 3)


def criticality(kind: str, form: Coefficient) -> str:
    """ "supercritical" or "subcritical", by the coefficient, `UNDECIDED` if that is not above its error; "" if there is
    none."""
    if np.isnan(form.value):
        return ""
    if abs(form.value) <= form.error:
        return UNDECIDED
    return "supercritical" if form.value * KINDS[kind].supercritical > 0.0 else "subcritical"


def _at_zero(node: Node) -> tuple[Problem, Vector]:
    """At phase 0 of the forcing, unless an event is near it, and in one segment."""
    problem = node.problem
    if isinstance(problem, FlowProblem) and (problem.phase or problem.cuts):
        moved = replace(problem, phase=0.0, cuts=())
        z = problem.shifted(node.z, node.seen, 0.0, moved)
        seen = look(moved, z)
        if seen is not None and cyclic(seen.word) == node.word and moved.rephased(z, seen, node.scales) is None:
            return moved, z
        moved = replace(problem, cuts=())
        return moved, problem.shifted(node.z, node.seen, problem.phase, moved)
    return problem, node.z


def _projected(passes: str, still: bool, a: Vector, b: Vector, c: Vector) -> _Cubic | None:
    """Of a map or, ``still``, of rates; None where no pair is complex: a saddle whose eigenvalues add up to zero."""
    eigen: Any = np.linalg.eig(a)
    values, rights = eigen
    if passes == "circle":
        paired = np.flatnonzero(values.imag > 0.0)
        if not len(paired):
            return None
        index = paired[np.abs(values.real[paired] if still else np.abs(values[paired]) - 1.0).argmin()]
    else:
        index = np.abs(values - float(passes)).argmin()
    mu, q = values[index], rights[:, index]
    p = np.linalg.inv(rights)[index]  # a row, <p, .> with its conjugate taken already
    q = q / np.linalg.norm(q)
    p = p / (p @ q)
    second, third = _forms(b, c)
    n, identity = len(a), np.eye(len(a))
    if passes == "circle":
        conjugate = q.conj()
        slow, fast = (0.0, 2j * mu.imag) if still else (1.0, mu**2)
        cubic = third(q, q, conjugate) + 2.0 * second(q, np.linalg.solve(slow * identity - a, second(q, conjugate)))
        cubic += second(conjugate, np.linalg.solve(fast * identity - a, second(q, q)))
        if still:
            p = p / (2.0 * mu.imag)
            return _Cubic(float(np.real(p @ cubic)), p, q)
        return _Cubic(float(np.real(np.conj(mu) / abs(mu) * (p @ cubic))) / 2.0, p / 2.0, q)
    if passes == "+1":
        bordered = np.block([[identity - a, q[:, None]], [p[None, :], np.zeros((1, 1))]])
        aside = np.linalg.solve(bordered, np.append(second(q, q), 0.0))[:n]
    else:
        aside = np.linalg.solve(identity - a, second(q, q))
    return _Cubic(float(np.real(p @ (third(q, q, q) / 6.0 + second(q, aside) / 2.0))), p / 6.0, q)


def _forms(b: Vector, c: Vector) -> tuple[Callable[..., NDArray[Any]], Callable[..., NDArray[Any]]]:
    """The second and the third derivative along vectors."""

    def second(u: NDArray[Any], v: NDArray[Any]) -> NDArray[Any]:
        return np.einsum("ijk,j,k->i", b, u, v)

    def third(u: NDArray[Any], v: NDArray[Any], w: NDArray[Any]) -> NDArray[Any]:
        return np.einsum("ijkl,j,k,l->i", c, u, v, w)

    return second, third


def _derivatives(problem: Problem, z: Vector, widths: Vector) -> tuple[Vector, Vector, Vector]:
    """A (n, n), B (n, n, n), C (n, n, n, n) of the map at z. Lost: an event comes or goes within the widths."""
    n = len(widths)
    word = None

    def matrix(*steps: tuple[int, int]) -> Vector:
        nonlocal word
        x = z.copy()
        for k, sign in steps:
            x[k] += sign * widths[k]
        seen = look(problem, x)
        word = seen.word if word is None and seen is not None else word
        if seen is None or seen.word != word:
            raise Lost("an event comes or goes")
        return seen.monodromy

    a = matrix()
    ups, downs = [matrix((k, 1)) for k in range(n)], [matrix((k, -1)) for k in range(n)]
    b, c = np.empty((n, n, n)), np.empty((n, n, n, n))
    for k in range(n):
        b[:, :, k] = (ups[k] - downs[k]) / (2.0 * widths[k])
        c[:, :, k, k] = (ups[k] - 2.0 * a + downs[k]) / widths[k] ** 2
        for m in range(k):
            signs = ((1, 1), (1, -1), (-1, 1), (-1, -1))
            mixed = sum((i * j * matrix((k, i), (m, j)) for i, j in signs), np.zeros((n, n)))
            c[:, :, k, m] = c[:, :, m, k] = mixed / (4.0 * widths[k] * widths[m])
    return a, b, c
