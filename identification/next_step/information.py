"""What a log tells of parameters, and how well they are known with it: common to all that is foretold.

    I = D'D/sd^2,    sd' = sqrt(diag((P + I)^-1))

D: slopes of what is measured by the parameters, start states projected out; P: precision before. Candidates are ranked
by the geometric mean of sd', which no unit enters.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from identification.calibration.untold import TAKES_PART

LOST = 1e-12  # of the largest eigenvalue of the scaled precision: a direction that is not told


def rank(refused: str | None, deviations: Mapping[str, float | None]) -> tuple[bool, float]:
    """Place of a candidate among others: the best first, those refused last."""
    return refused is not None, mean_logarithm(deviations)


def mean_logarithm(deviations: Mapping[str, float | None]) -> float:
    """Mean ln of deviations, infinite where one is not told."""
    stated = [sd for sd in deviations.values() if sd]
    return float(np.mean(np.log(stated))) if stated and len(stated) == len(deviations) else np.inf


def free_of(columns: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Columns (n, m) without what others (n, k) do as well."""
    return columns - others @ np.linalg.lstsq(others, columns, rcond=None)[0]


def deviations_of(precision: np.ndarray, names: Sequence[str], chosen: Sequence[str]) -> dict[str, float | None]:
    """Deviations by name, from a precision (m, m) of all names; None of what is not told."""
    sizes = np.sqrt(np.diag(precision))
    told = np.flatnonzero(sizes > 0)
    deviations: dict[str, float | None] = dict.fromkeys(chosen)
    if told.size:
        values, vectors = np.linalg.eigh(precision[np.ix_(told, told)] / np.outer(sizes[told], sizes[told]))
        determined = values > LOST * values[-1]
        lost = np.any(np.abs(vectors[:, ~determined]) > TAKES_PART, axis=1)
        spread = np.sqrt((vectors[:, determined] ** 2) @ (1 / values[determined])) / sizes[told]
        for n, sd, unseen in zip(told.tolist(), spread.tolist(), lost, strict=True):
            if names[n] in chosen and not unseen:
                deviations[names[n]] = sd
    return deviations
