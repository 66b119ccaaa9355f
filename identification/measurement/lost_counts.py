"""Counts that the encoder of the body lost or made up, as a laser beside it shows.

The offset of encoder to laser moves slowly: by what a gain or a delay of the laser is off between one edge and the
next. A count that is lost moves it by a whole pitch at once, and for good.
"""

import numpy as np

SURE = 0.25  # of a pitch: how near to a whole number of them a jump is
SELDOM = 0.02  # of all edges: where more jump, the pitch is wrong and not the count


def lost_counts(offset: np.ndarray, pitch: float) -> np.ndarray:
    """Counts (n,) too many at each edge, from its offset to the laser (n,) rad; 0 at the first."""
    jumps = np.diff(offset) / pitch
    whole = np.round(jumps)
    whole[np.abs(jumps - whole) > SURE] = 0.0
    if np.count_nonzero(whole) > SELDOM * len(offset):
        return np.zeros(len(offset))
    return np.concatenate([[0.0], np.cumsum(whole)])


def lost_words(name: str, time: np.ndarray, counts: np.ndarray) -> tuple[str, ...]:
    """What is said of them. time: (n,) s."""
    at = np.flatnonzero(np.diff(counts))
    if not len(at):
        return ()
    first = ", ".join(f"{counts[i + 1] - counts[i]:+.0f} at {time[i + 1]:.4g} s" for i in at[:5])
    more = f" and {len(at) - 5} times more" if len(at) > 5 else ""
    return (
        f"Log '{name}': against the laser the encoder of the body counted wrong by {first}{more}. That was taken off; "
        "look at its light gap, its cable and the highest rate of its counter.",
    )
