"""Power bonds: an effort one way and a flow the other way between two units, and the energy that stepping makes there.

    P = (e - de) f - e (f - df) = e df - de f

is the power that one end of a bond gives and the other does not take: each unit meets its own value with what it
expected of the other. e and f are those at the end of a step, de and df their errors. A bond is a pair of connections
in opposite directions whose units of measure give a power: N and m/s, N m and rad/s, V and A.

Source: Sadjina, Kyllingstad, Skjong and Pedersen, Energy conservation and power bonds in co-simulations: non-iterative
adaptive step size control and error estimation, Engineering with Computers 33 (2017).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.unit_names import base_units
from fmu_models.coupling.histories import Vector
from fmu_models.coupling.wiring import Wire, unit_of

if TYPE_CHECKING:
    from fmu_models.fmu.fmu import Fmu

POWER = {"kilogram": 1.0, "meter": 2.0, "second": -3.0}


class PowerBonds:
    """The bonds among the signals of a co-simulation, and what has passed through them so far. signals: the wires of
    the n signals, in their order."""

    def __init__(self, fmus: Mapping[str, Fmu], signals: Sequence[Wire]) -> None:
        powers = [_powers(fmus, wire) for wire in signals]
        pairs = [
            (i, k)
            for i, one in enumerate(signals)
            for k, other in enumerate(signals[:i])
            if (one.source[0], one.target[0]) == (other.target[0], other.source[0]) and _is_power(powers[i], powers[k])
        ]
        # where one fits several, units of measure do not tell which belong together
        uses = Counter(i for pair in pairs for i in pair)
        pairs = [pair for pair in pairs if all(uses[i] == 1 for i in pair)]
        self._ends = np.array(pairs, dtype=int).reshape(-1, 2).T
        self._names = [" and ".join(".".join(signals[i].source) for i in pair) for pair in pairs]
        self._made, self._passed = np.zeros((2, len(pairs)))

    def add(self, h: float, values: Vector, defects: Vector) -> None:
        """A step of h at the end of which the signals (n,) were ``defects`` more than expected."""
        if self._names:
            (e, f), (de, df) = values[self._ends], defects[self._ends]
            self._made += np.abs(e * df - de * f) * h
            self._passed += np.abs(e * f) * h

    @property
    def words(self) -> str:
        """How much energy the steps have made or lost at each bond, as a share of what passed."""
        shares = self._made / np.where(self._passed > 0.0, self._passed, 1.0)
        texts = [f"{share:.2g} at {name}" for share, name in zip(shares, self._names, strict=True)]
        return f"; of the energy passed, made or lost by stepping: {', '.join(texts)}" if texts else ""


def _powers(fmus: Mapping[str, Fmu], wire: Wire) -> dict[str, float]:
    """Of the base units of what a wire brings, but for angles; none where its unit of measure is none."""
    unit, name = wire.target
    try:
        powers = base_units(unit_of(fmus[unit], fmus[unit].variables[name]) or "1").powers
    except ValueError:
        return {}
    return {base: power for base, power in powers if base != "radian"}


def _is_power(one: Mapping[str, float], other: Mapping[str, float]) -> bool:
    product = {base: one.get(base, 0.0) + other.get(base, 0.0) for base in {*one, *other}}
    return bool(one) and bool(other) and {base: power for base, power in product.items() if power} == POWER
