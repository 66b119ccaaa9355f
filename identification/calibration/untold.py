"""What logs do not tell, by the slopes of their residuals: before a search from a guess, after it from the solution.

segments that meet:  C_p dp + C_s ds = 0,    ds = -C_s^+ C_p dp + N w,    N the null space of C_s
"""

import warnings
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.calibration.problem import SegmentProblem
from identification.inference.problem import Evaluation, Unknown, prior_precision

UNTOLD = 1e-4  # of the largest singular value of the scaled slopes: a direction that the logs do not tell
LOST = 1e-11  # likewise: rounding, whatever the noise
CERTAIN = 1e-6  # likewise, of a guess, whose slopes are not those of the solution
TAKES_PART = 0.01  # of the largest effect of a direction: who has less has no part in it
SILENT = 1e-9  # deviations of the noise by which a parameter moves the residuals if it is doubled: none

Names = tuple[str, ...]


def untold_directions(
    slopes: np.ndarray, prior: np.ndarray, unknowns: Sequence[Unknown], values: np.ndarray, least: float = UNTOLD
) -> tuple[np.ndarray, tuple[Names, ...]]:
    """Directions (k, j) that rows (n, k) and priors tell, and the names that take part in each of the others. Along
    these the singular value is small, and noise moves a parameter by as much as it is: of a chaotic motion small ones
    may tell.

    slopes: by the shared unknowns, of these values, then by start states.
    """
    rows = np.vstack([slopes, np.sqrt(np.maximum(np.diag(np.diag(prior)), 0.0))])
    norms = column_norms(rows)
    _, singular, right = np.linalg.svd(rows / norms, full_matrices=False)
    shared = len(unknowns)
    moves = np.abs(right[:, :shared]) / norms[:shared] / np.maximum(singular, np.finfo(float).tiny)[:, None]
    # by how much each would have to move to be another one: by itself, and an angle by a radian
    sizes = [max(abs(x), 1.0 if u.unit == "rad" else SILENT) for u, x in zip(unknowns, values[:shared], strict=True)]
    blurred = np.max(moves / np.array(sizes), axis=1, initial=0.0) > 1
    observable = (singular > least * singular[0]) | ~blurred & (singular > LOST * singular[0])
    untold = []
    for vector in np.abs(right[~observable]):
        part = vector > TAKES_PART * np.max(vector)
        together = [unknown.name for unknown, takes in zip(unknowns, part, strict=False) if takes]
        untold.append((*together, *(("the start",) if part[shared:].any() else ())))
    return (right[observable] / norms).T, tuple(untold)


def column_norms(columns: np.ndarray) -> np.ndarray:
    """(m,) lengths of columns, 1 of an empty one."""
    norms = np.linalg.norm(columns, axis=0)
    return np.where(norms > 0, norms, 1.0)


def meeting(here: Evaluation, problem: SegmentProblem) -> np.ndarray:
    """(m, k) directions in which segments still meet: the shared unknowns, then those of start states."""
    joints = here.gradient[here.log >= len(problem.series)]
    count, shared = here.gradient.shape[1], problem.shared
    if not len(joints):
        return np.eye(count)
    sizes = np.ones(count)
    for places in problem.starts:
        sizes[places[places >= 0]] = problem.scale[places >= 0]
    scaled = joints[:, shared:] * sizes[shared:] / problem.weight
    follows = -np.linalg.lstsq(scaled, joints[:, :shared] / problem.weight, rcond=None)[0]
    null = np.linalg.qr(scaled.T, mode="complete")[0][:, len(joints) :]
    whole = np.block([[np.eye(shared), np.zeros((shared, null.shape[1]))], [follows, null]])
    return sizes[:, None] * whole


def words(names: Names) -> str:
    """An untold direction."""
    if len(names) == 1:
        return f"{names[0]} is not told: nothing measured moves with it"
    return f"{', '.join(names[:-1])} and {names[-1]} move together unseen"


def telling(
    candidates: Iterable[np.ndarray],
    posed: Callable[[np.ndarray], tuple[SegmentProblem, np.ndarray]],
    count: int,
    most: int,
) -> list[np.ndarray]:
    """The first ``count`` of guesses at which every parameter has an effect, and if these are too few, those at which
    fewest have none; with a warning of what the first of them does not tell, before any search. posed: the problem of a
    guess, and its unknowns; most: guesses that are tried, unless some parameter is silent at all of them: then the
    others are tried for its sake.

    Raises:
        StickslipError: no guess can be run, or a parameter has no effect at any of them.
    """
    judged: list[tuple[int, np.ndarray]] = []
    heard = np.zeros(0, dtype=bool)
    for candidate in candidates:
        problem, x = posed(candidate)
        here = problem.evaluate(x)
        slopes = here.gradient[here.log < len(problem.series)]
        sizes = np.maximum(np.abs(x[: problem.shared]), SILENT)
        effects = np.max(np.abs(slopes[:, : problem.shared]), axis=0) * sizes > SILENT
        if not judged and effects.all():
            _warn_of_untold(problem, x, slopes @ meeting(here, problem))
        heard = heard | effects if judged else effects
        judged.append((int(np.count_nonzero(~effects)), candidate))
        if [silent for silent, _ in judged].count(0) == count or (len(judged) >= most and heard.all()):
            break
    _check_heard(posed(judged[0][1])[0], heard, len(judged))
    judged.sort(key=lambda one: one[0])
    return [candidate for _, candidate in judged[:count]]


def _warn_of_untold(problem: SegmentProblem, x: np.ndarray, slopes: np.ndarray) -> None:
    shared = problem.unknowns[: problem.shared]
    names = [unknown.name for unknown in shared]
    prior = np.zeros((slopes.shape[1],) * 2)
    prior[: len(names), : len(names)] = prior_precision(problem)[: len(names), : len(names)]
    for direction in untold_directions(slopes, prior, shared, x, CERTAIN)[1]:
        if any(name in names for name in direction):
            warnings.warn(f"At the guess {words(direction)}.", stacklevel=2)


def _check_heard(problem: SegmentProblem, heard: np.ndarray, count: int) -> None:
    if not heard.any():
        raise StickslipError(
            f"'{problem.subject.fmu.description.modelName}' could not be run over any part of the logs with any of "
            f"{count} guesses. Give first values nearer to the truth (--set)."
        )
    for place in np.flatnonzero(~heard):
        raise StickslipError(
            f"'{problem.unknowns[place].name}' has no effect on what is measured, at any of {count} guesses: nothing "
            "depends on it, or a contact that it belongs to is never met. Hold it, or begin with other values (--set)."
        )
