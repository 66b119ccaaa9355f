"""What a laser shows of a disc that turns, by the way it meets it: d = R (f(angle + tilt) - f(tilt))."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np


@dataclass(frozen=True)
class Beam:
    """words: what the laser looks at; formula: d, for people; shows: f; angle: its inverse; cubic: of angle^3 in f;
    turning: f'' over f' and the tangent of a tilt."""

    words: str
    formula: str
    shows: Callable[[np.ndarray], np.ndarray]
    angle: Callable[[np.ndarray], np.ndarray]
    cubic: float
    turning: float


BEAMS: Mapping[str, Beam] = MappingProxyType(
    {
        "sine": Beam("a target that the border carries", "R sin(angle)", np.sin, np.arcsin, -1 / 6, -1.0),
        "arc": Beam("the way along the border", "R angle", lambda angle: angle, lambda shown: shown, 0.0, 0.0),
        "tangent": Beam("a flat arm that turns with the disc", "R tan(angle)", np.tan, np.arctan, 1 / 3, 2.0),
    }
)
