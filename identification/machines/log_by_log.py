"""Whether an effort of one log is another multiple of the motion than in the other logs: a sign, a unit, a gear.

tau = gain Y theta    theta by least squares from the other logs
"""

from collections.abc import Sequence

import numpy as np

from identification.machines.identify import Identified

ALIKE = 0.9  # cosine of an effort and what the other logs lead to expect, from which its gain means something
ODD = 5.0  # times and more: less may be another load or temperature, or noise in the columns


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
