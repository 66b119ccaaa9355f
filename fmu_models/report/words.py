"""What pictures say: symbols, labels of axes, words of motions, constants of a scene."""

from __future__ import annotations

import re
import textwrap
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from fmu_models.scene.scene import Scene

_GREEK = (
    "alpha|beta|gamma|delta|epsilon|zeta|eta|theta|iota|kappa|lambda|mu|nu|xi|pi|rho|sigma|tau|upsilon|phi|chi|psi|"
    "omega|Gamma|Delta|Theta|Lambda|Xi|Pi|Sigma|Upsilon|Phi|Psi|Omega"
)
# a letter, and what stands below it: digits, one letter more, or what an underscore or a capital parts from it
_SYMBOL = re.compile(rf"({_GREEK}|[A-Za-z])(?:_?(\d+|[a-z]\d*|[A-Z]\d*)|_(\w+))?")
WIDTH = 50  # letters in a line of a label
CAPTION = 110  # and of a caption under a page
TIMES = {1: "once", 2: "twice"}


def symbol(name: str) -> str:
    """A name as a formula has it, where it is one letter and what stands below it: mu_s0 is one, gap is none.

    >>> symbol("k0"), symbol("gap")
    ('$k_{0}$', 'gap')
    """
    match = _SYMBOL.fullmatch(name)
    if match is None:
        return name.replace("$", r"\$")
    letter, below = match[1], match[2] or match[3]
    letter, below = (f"\\{part}" if part in _GREEK.split("|") else part for part in (letter, below))
    return f"${letter}_{{{below}}}$" if below else f"${letter}$"


def axis_label(name: str, units: Mapping[str, str], width: int = WIDTH) -> str:
    """What a quantity is, its symbol and its unit. units: by name, with ``descriptions`` where these are known."""
    text = re.split(r"[,;:(]", getattr(units, "descriptions", {}).get(name, ""))[0].strip().replace("$", r"\$")
    unit = units.get(name, "1")
    # the rate of a coordinate is said by the symbol of that
    of = re.fullmatch(r"rate of (\w+)", text)
    text = f"rate of {symbol(of[1])}," if of else text
    label = " ".join(part for part in (text, symbol(name), f"({unit})" if unit not in ("1", "") else "") if part)
    return textwrap.fill(label, width, break_long_words=False)


def in_words(word: str, units: Mapping[str, str]) -> str:
    """The word n-p-q of a motion, and how often each contact begins. units: with ``contacts``, their names in order."""
    contacts: Sequence[str] = getattr(units, "contacts", ())
    match = re.match(r"(\d+)((?:-\d+)+)", word)
    counts = [int(count) for count in match[2].split("-")[1:]] if match else []
    if match is None or len(counts) != len(contacts):
        return word
    begins = [f"{c} {TIMES.get(n, f'{n} times')}" for c, n in zip(contacts, counts, strict=True) if n]
    return f"{match[0]}: {', '.join(begins) or 'without contact'}{word[match.end() :]}"


def caption(scene: Scene) -> str:
    """The constants of a scene, and where these depart from its file."""
    whole = "\N{NO-BREAK SPACE}"  # in what no line parts
    constants = "; ".join(constant.replace(" ", whole) for constant in _constants(scene))
    lines = [line.replace(whole, " ") for line in textwrap.wrap(constants, CAPTION, break_long_words=False)]
    departs = [f"{symbol(name)} is {known:g} in the scene" for name, known in scene.departs.items()]
    return "\n".join([*lines, *(["departs: " + ", ".join(departs)] if departs else [])])


def _constants(scene: Scene) -> Iterable[str]:
    for name, value in scene.constants.items():
        unit = scene.units.get(name, "1")
        yield f"{symbol(name)} = {value:.6g}{'' if unit == '1' else f' {unit}'}"
