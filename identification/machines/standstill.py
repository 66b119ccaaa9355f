"""Whether rows in which a joint hardly moves pull the values: least squares with them and without.

    shift = (without - with)/deviation without

A joint that is held at its turns by friction takes any effort below that of sliding, and sgn v says nothing of it. Of a
machine that slides throughout the two estimates differ by less than the deviation of the lesser one (Hausman).

Source: Hausman (1978), Econometrica 46, 1251 (two estimates, one of which is consistent under both hypotheses).
"""

from dataclasses import replace

import numpy as np

from identification.machines.identify import Estimated, Identified
from identification.machines.motion import Cutoffs, in_rows, weighed
from identification.machines.rows import INDISTINGUISHABLE, Rows, balanced, together

STILL = 0.1  # of the usual speed
LEFT = 0.5  # of the rows of a joint: with fewer left the motion is one of turns
SURE = 3.0  # deviations


def moving(result: Identified, cutoffs: Cutoffs) -> Rows | None:
    """The rows without weight for joints at rest; None if too few are left."""
    pieces = weighed(result.pieces, replace(cutoffs, still=STILL))
    rows = replace(result.rows, trust=in_rows([piece.weight[piece.indices] for piece in pieces]))
    joints = range(len(rows.deviation))
    if any(np.mean(rows.used[rows.joint == joint]) < LEFT for joint in joints):
        return None
    rows = balanced(rows)
    idle = not rows.names or not np.all(rows.weighted[0].any(axis=0))
    return None if idle or together(rows)[0] > INDISTINGUISHABLE else rows


def pulled(result: Identified, without: Estimated) -> dict[str, tuple[float, float]]:
    """Values by least squares with all rows and without those at rest, by name of the base parameters whose values
    differ for sure."""
    every = result.least_squares
    sure = np.abs(without.values - every.values) > SURE * without.deviation
    each = zip(result.rows.names, every.values, without.values, sure, strict=True)
    return {name: (float(full), float(reduced)) for name, full, reduced, differs in each if differs}
