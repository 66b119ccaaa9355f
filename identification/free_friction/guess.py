"""Where a search for what slips share stands, and what slips say there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

MODES = 4  # of what no term explains, in each slip
STARTS = 2  # angle and speed, of each slip
YIELDS, AHEAD = "yields", "sigma1/sigma0"  # of a contact that gives way: y, and by which its friction is ahead, s
WRONG = "*"  # after the name of a constant: how far it is off beyond its stated uncertainty


@dataclass(eq=False)
class Guess:
    """Where a search is. coefficients: of the curve; starts (n_slips, STARTS): rad, rad/s; unexplained: (n_slips,
    MODES); shared: logarithms of constants over their values, gain, delay, terms, by name."""

    coefficients: np.ndarray
    starts: np.ndarray
    unexplained: np.ndarray
    shared: dict[str, float] = field(default_factory=dict)

    def values(self, names: Sequence[str]) -> np.ndarray:
        """Coefficients and named values (m,)."""
        return np.concatenate([self.coefficients, [self.shared.get(name, 0.0) for name in names]])

    def moved(self, step: np.ndarray, local: np.ndarray, names: Sequence[str]) -> Guess:
        """Another, with steps of coefficients and named values (m,) and of each slip (n_slips, STARTS + MODES)."""
        count = len(self.coefficients)
        values = {name: self.shared.get(name, 0.0) + float(s) for name, s in zip(names, step[count:], strict=True)}
        return Guess(
            self.coefficients + step[:count],
            self.starts + local[:, :STARTS],
            self.unexplained + local[:, STARTS:],
            self.shared | values,
        )


@dataclass(frozen=True, eq=False)
class SlipRows:
    """Whitened residuals of one slip (n,), and their derivatives by what is its own (n, STARTS + MODES) and by what all
    share (n, m)."""

    residual: np.ndarray
    local: np.ndarray
    shared: np.ndarray
