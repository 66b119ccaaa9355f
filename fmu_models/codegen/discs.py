"""The lines of C that bound what series miss: radii of the discs that operations on series map discs of time to.

A line gives the radius ``b->w[n]`` of the image of a disc from the centre, coefficient 0, and the radius of its
operands (engine/model/discs.h), for several discs of time at once. Series are *seen* whose every term shows in their
coefficients: states, inputs, time, phases in proportion to time, and sums of these. All other functions may be flat
where they are expanded and not beyond (a Gauss curve, tanh, a high power); of sums only these parts count.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

# name of a recurrence -> the disc {r} of its series {y} from operands {0}, {1}, ... and their discs {r0}, {r1}, ...
_IMAGES = {
    "product": "disc_product({r}, {0}[0], {r0}, {1}[0], {r1});",
    "square": "disc_product({r}, {0}[0], {r0}, {0}[0], {r0});",
    "power": "disc_power({r}, {0}[0], {r0}, {1}, {y}[0]);",
    "lifted": "disc_lifted({r}, {0}[0], {r0}, {1});",
    "sqrt": "disc_sqrt({r}, {0}[0], {r0}, 1.0);",
    "root": "disc_root({r}, {0}[0], {r0});",
    "exp": "disc_exp({r}, {0}[0], {r0}, {y}[0]);",
    "log": "disc_log({r}, {0}[0], {r0});",
    "atan": "disc_atan({r}, {0}[0], {r0});",
    "reciprocal": "disc_quotient({r}, 0, {0} + {1} * {2}[0], {1}, {r2}, {y}[0]);",
    "quotient": "disc_quotient({r}, {r0}, {1} + {2} * {3}[0], {2}, {r3}, {y}[0]);",
    "turns": "disc_multiple({r}, 6.283185307179586 * fabs({0}), {r2});",
    "angle": "disc_multiple({r}, fabs({0}), {r2});",
    "tanh": "disc_tanh({r}, {0}[0], {r0}, {y}[0]);",
    **dict.fromkeys(("sin", "cos", "sinh", "cosh", "sin_phase", "cos_phase"), "disc_wave({r}, {r0}, {y}[0], {1}[0]);"),
}
_SEEN = ("turns", "angle", "sin_phase", "cos_phase")
_BASE = re.compile(r"j->(?:t|(?:u|du|x|pile)\[\d+\])")
_READ = re.compile(r"b->x\[(\d+)\]")
# of these series functions read the discs, of those products with an inertia that moves; of others only what is unseen
_READ_BY_FUNCTIONS = re.compile(r"j->(?:w|slip|depth)\[")
_MULTIPLIED = re.compile(r"j->(?:a|force|slip_rate|W|G|M)\[")


def disc(series: str) -> str:
    """The name of the disc of a series.

    >>> disc("j->x[1]")
    'b->x[1]'
    """
    return series.replace("j->", "b->")


@dataclass
class Discs:
    """The body of one function: statements with the series that they are of, "" for those of more than one.

    seen: the series of the model that are, shared by its functions; moving: whether inertia depends on more than
    parameters.
    """

    seen: set[str]
    moving: bool
    lines: list[tuple[str, str, str]] = field(default_factory=list)
    unseen: bool = False  # some series that it sets is not seen

    def image(self, y: str, name: str, operands: tuple[str, ...]) -> None:
        """The disc of a new series that a recurrence computes."""
        radii = {f"r{i}": disc(operand) for i, operand in enumerate(operands)}
        self.lines.append((disc(y), _IMAGES[name].format(*operands, y=y, r=disc(y), **radii), ""))
        if name in _SEEN:
            self.seen.add(y)

    def sum(self, target: str, terms: Mapping[str, str]) -> None:
        """The disc of a sum of series with constant factors."""
        unseen = {series: factor for series, factor in terms.items() if not self._sees(series)}
        multiplied = self.moving and bool(_MULTIPLIED.match(target))
        summands = terms if multiplied or _READ_BY_FUNCTIONS.match(target) else unseen
        calls = ["disc_multiple", *["disc_add"] * (len(summands) - 1)]
        lines = [
            f"{call}({disc(target)}, fabs({factor}), {disc(series)});"
            for call, (series, factor) in zip(calls, summands.items(), strict=False)
        ]
        self.lines.append((disc(target), " ".join(lines) or f"disc_zero({disc(target)});", ""))
        if not unseen and not multiplied:
            self.seen.add(target)
        elif not target.startswith("j->w["):
            self.unseen = True

    def state(self, statement: str) -> None:
        """Something else, which may read any disc."""
        self.lines.append(("", statement, ""))

    def statements(self, read: set[str]) -> list[str]:
        """C code, without the new series that nobody reads."""
        return [text for target, text, _ in self.lines if not target.startswith("b->w[") or target in read]

    def _sees(self, series: str) -> bool:
        return bool(_BASE.fullmatch(series)) or series in self.seen


def states_read(statements: Iterable[str]) -> set[int]:
    """Indices of the states whose discs statements read."""
    return {int(index) for text in statements for index in _READ.findall(text)}
