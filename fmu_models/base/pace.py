"""How long work will still take, from what was done when.

    speed = what was done in the latter part of the time so far / that time
    end   = now + (1 - done)/speed, and its running mean

The end is told while the latter half and the latter quarter of the time agree on it: work whose parts go at different
speeds (a quick fit before a long bootstrap) says nothing for a while instead of something wrong.
"""

import math
from bisect import bisect_right

PARTS = (0.5, 0.25)  # of the time so far: the shares whose speeds must agree
STEPS = 3  # at least, in the shorter of them
AGREED = 1.6  # ratio of remaining times up to which they do
SMOOTHED = 0.1  # of the time so far: how long the running mean remembers
EARLY = 4.0  # s before which nobody can say
APART = 0.05  # s between samples that are kept


class Pace:
    """The pace of one piece of work, which begins now (0 s) with nothing done."""

    def __init__(self) -> None:
        self.times, self.done = [0.0], [0.0]
        self.mean: float | None = None

    def remaining(self, elapsed: float, done: float) -> float | None:
        """Seconds still needed when a share ``done`` is finished after ``elapsed`` s; None where nobody can say yet."""
        last = self.times[-1]
        if elapsed >= last + APART:
            self.times.append(elapsed)
            self.done.append(done)
        estimates = [self._remaining(fraction, elapsed, done) for fraction in PARTS]
        least, greatest = min(estimates), max(estimates)
        if elapsed < EARLY or not greatest < math.inf or greatest > AGREED * least + 1:
            self.mean = None
            return None
        end = elapsed + estimates[0]
        share = 1 - math.exp(-(elapsed - last) / (SMOOTHED * elapsed))
        self.mean = end if self.mean is None else self.mean + share * (end - self.mean)
        return max(self.mean - elapsed, 0.0)

    def _remaining(self, fraction: float, elapsed: float, done: float) -> float:
        """Seconds at the speed of the latter part of the time so far; infinite where too little was done in it."""
        since = bisect_right(self.times, elapsed * (1 - fraction)) - 1
        # a share that falls back, as where a search begins anew, says nothing either
        if len(set(self.done[since:])) <= STEPS or done <= self.done[since]:
            return math.inf
        return (1 - done) * (elapsed - self.times[since]) / (done - self.done[since])


def spoken(seconds: float) -> str:
    """A duration as people say it."""
    total = math.ceil(seconds)
    if total < 60:
        return f"{total} s"
    return f"{total // 60} min {total % 60:02d} s" if total < 3600 else f"{total // 3600} h {total // 60 % 60:02d} min"
