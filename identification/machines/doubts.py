"""What logs say against a model of rows: joints that stick, efforts that come late, a log that is another multiple.

    shift = (without - with)/deviation without      least squares without rows in which a joint hardly moves, and with
    tau = Y theta - d d(Y theta)/dt                 a delay d of the efforts, one more unknown
    tau = gain Y theta                              theta by least squares from the other logs

A joint that is held at its turns by friction takes any effort below that of sliding, and sgn v says nothing of it. Of a
machine that slides throughout the two estimates differ by less than the deviation of the lesser one (Hausman). Rows of
joints at rest say of a delay what friction makes of them: they are left out. A gain is of a sign, a unit, a gear.

Source: Hausman (1978), Econometrica 46, 1251 (two estimates, one of which is consistent under both hypotheses).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.inference.problem import Unknown
from identification.machines.identify import Estimated, Identified, least_squares
from identification.machines.motion import Cutoffs, JointMotion, in_rows, stacked, weighed
from identification.machines.rows import INDISTINGUISHABLE, Rows, balanced, together

STILL = 0.1  # of the usual speed
LEFT = 0.5  # of the rows of a joint: with fewer left the motion is one of turns
SURE = 3.0  # deviations
LATE = 5.0  # deviations of a delay
STEPS = 0.5  # of the logs: less is within what a clock leaves open
ALIKE = 0.9  # cosine of an effort and what the other logs lead to expect, from which its gain means something
ODD = 5.0  # times and more: less may be another load or temperature, or noise in the columns


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


def effort_delay(identified: Identified, moving: Rows, without: Estimated) -> tuple[float, float] | None:
    """Delay of all efforts behind the positions and its deviation, s; None if there is none for sure. moving: as
    `moving` gives them; without: least squares of these, without a delay."""
    regressor = identified.regressor
    values = identified.base.whole(without.values)

    def rate(motion: JointMotion) -> np.ndarray:
        efforts = regressor(motion.position, motion.velocity, motion.acceleration) @ values
        return np.gradient(efforts, motion.step, axis=0)

    late = Unknown("delay", "s", description="delay of the efforts")
    columns = np.column_stack([moving.columns, -stacked(identified.pieces, rate)])
    with_delay = least_squares(balanced(replace(moving, columns=columns, unknowns=(*moving.unknowns, late))))
    delay, deviation = float(with_delay.values[-1]), float(with_delay.deviation[-1])
    sure = abs(delay) > max(LATE * deviation, STEPS * identified.pieces[0].step)
    return (delay, deviation) if sure else None


def on_logs(result: Identified, names: Sequence[str]) -> list[str]:
    """Verdicts on logs, a sentence for each joint; none for a single log. names: of the logs, by their number."""
    rows, joints = result.rows, result.regressor.joints
    numbers = np.unique(rows.log)
    if len(numbers) < 2:
        return []
    odd: dict[str, list[str]] = {joint: [] for joint in joints}
    for log in numbers:
        columns, effort = rows.where(rows.log != log).weighted
        expected = rows.given + rows.columns @ np.linalg.lstsq(columns, effort, rcond=None)[0]
        for number, joint in enumerate(joints):
            mine = rows.used & (rows.log == log) & (rows.joint == number)
            gain, cosine = _gain(rows.effort[mine], expected[mine])
            if abs(cosine) > ALIKE and not 1 / ODD < gain < ODD:
                odd[joint].append(f"{gain:.3g} times in {names[log]}")
    return [
        f"The effort of '{joint}' is not what the other logs lead to expect of the motion but {', '.join(gains)}: "
        "check its sign and unit there."
        for joint, gains in odd.items()
        if gains
    ]


def _gain(effort: np.ndarray, expected: np.ndarray) -> tuple[float, float]:
    """The gain of an effort over the expected one, and the cosine between both."""
    size, length = float(np.linalg.norm(expected)), float(np.linalg.norm(effort))
    if not size * length > 0:
        return 1.0, 0.0
    product = float(effort @ expected)
    return product / size**2, product / (size * length)
