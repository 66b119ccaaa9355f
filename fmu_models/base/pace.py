"""How long work will still take, from what was done when.

    speed = what was done in the latter half of the time so far / that time
    end   = now + (1 - done)/speed, and its running mean

An end is told once the running mean agrees with it: work whose parts go at different speeds (a quick fit before a long
bootstrap) says nothing for a while instead of something wrong.
"""

from __future__ import annotations

import math
from bisect import bisect_right

RECENT = 0.5  # of the time so far: the share whose speed counts
SMOOTHED = 0.2  # of the time so far: how long the running mean remembers
AGREED = 1.5  # ratio of remaining times up to which two ends agree
EARLY = 4.0  # s before which nobody can say
STEPS = 4  # at least, in that share of the time
APART = 0.05  # s between samples that are kept


class Pace:
    """Of one piece of work, which begins now (0 s) with nothing done."""

    def __init__(self) -> None:
        self.times, self.done = [0.0], [0.0]
        self.mean: float | None = None

    def remaining(self, elapsed: float, done: float) -> float | None:
        """Seconds still needed when a share ``done`` is finished after ``elapsed`` s; None where nobody can say yet."""
        last = self.times[-1]
        if elapsed >= last + APART:
            self.times.append(elapsed)
            self.done.append(done)
        since = bisect_right(self.times, elapsed * (1 - RECENT)) - 1
        gained = done - self.done[since]
        if len(set(self.done[since:])) <= STEPS:
            return None
        end = elapsed + (1 - done) * (elapsed - self.times[since]) / gained
        share = 1 - math.exp(-(elapsed - last) / (SMOOTHED * max(elapsed, APART)))
        self.mean = end if self.mean is None else self.mean + share * (end - self.mean)
        left, mean = end - elapsed, self.mean - elapsed
        return mean if elapsed > EARLY and 0 < mean < AGREED * left and left < AGREED * mean else None


def spoken(seconds: float) -> str:
    """A duration as people say it."""
    whole = math.ceil(seconds)
    if whole < 60:
        return f"{whole} s"
    return f"{whole // 60} min {whole % 60:02d} s" if whole < 3600 else f"{whole // 3600} h {whole // 60 % 60:02d} min"
