"""A friction law smoothed by the hyperbolic tangent: a regularisation, see ``language/smoothing.py``.

    sgn(v)  becomes  tanh(v/width)

Source: the smoothing that papers on discontinuous supports compare the switch model with.
"""

from dataclasses import dataclass
from typing import final

import sympy

from fmu_models.language.smoothing import Smoothed


@final
@dataclass(frozen=True)
class Tanh(Smoothed):
    """``law`` smoothed over the slip speed ``width``, m/s."""

    def shape(self, ratio: sympy.Expr) -> sympy.Expr:
        return sympy.tanh(ratio)


LAW = Tanh
