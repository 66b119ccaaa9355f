"""Kinds of special points in one table: what else knows a kind asks here.

A kind of a smooth point is where a multiplier passes +1, -1 or, in a pair, the circle; its test is that of
``Node.tests``, its curve in two parameters and its normal form follow from what passes. A new kind is a row, and a file
beside this one that locates it.
"""

from __future__ import annotations

from dataclasses import dataclass

FOLD, FLIP, NEIMARK_SACKER, HOPF = "fold", "flip", "Neimark-Sacker", "Hopf"
PITCHFORK, BRANCH_POINT, PARENT_FLIP = "pitchfork", "branch point", "flip of the parent"
COMPLIANT_GRAZING, RIGID_GRAZING, GRAZING = "grazing, compliant", "grazing, rigid", "grazing"
CORNER, TOUCH, EXCHANGE = "grazing-sliding corner", "touch", "sliding exchange"
DETACHMENT, TIE_OF_EVENTS, JUMP = "detachment", "tie", "jump"
DISCONTINUOUS_HOPF, DISCONTINUOUS_FOLD, MULTIPLE_CROSSING = (
    "discontinuous Hopf",
    "discontinuous fold",
    "multiple crossing",
)
BOUNDARY_EQUILIBRIUM, SURFACE_END = "boundary equilibrium", "end at a surface"


@dataclass(frozen=True)
class Kind:
    """What is known of a kind.

    Attributes:
        mark: of pictures, as matplotlib has it.
        passes: where a multiplier is at a smooth point, "+1", "-1" or, in a pair, "circle".
        crosses: two branches cross there, or one ends at another.
        supercritical: sign of the cubic coefficient of such a point; 0 where there is none.
        degenerate: the point of a curve where that vanishes.
    """

    mark: str
    passes: str = ""
    crosses: bool = False
    supercritical: int = 0
    degenerate: str = ""


# their order is that of legends
KINDS = {
    FOLD: Kind("s", "+1"),
    FLIP: Kind("D", "-1", supercritical=1, degenerate="generalized flip"),
    NEIMARK_SACKER: Kind("*", "circle", supercritical=-1, degenerate="Chenciner"),
    PITCHFORK: Kind("P", "+1", crosses=True, supercritical=-1, degenerate="degenerate pitchfork"),
    BRANCH_POINT: Kind("p", "+1", crosses=True),
    HOPF: Kind("h", "circle", supercritical=-1, degenerate="Bautin"),
    COMPLIANT_GRAZING: Kind("o"),
    RIGID_GRAZING: Kind("v"),
    GRAZING: Kind("o"),
    CORNER: Kind("^"),
    TOUCH: Kind("<"),
    EXCHANGE: Kind(">"),
    DETACHMENT: Kind("o"),
    TIE_OF_EVENTS: Kind("v"),
    JUMP: Kind("X"),
    PARENT_FLIP: Kind("d", "+1", crosses=True),
    DISCONTINUOUS_HOPF: Kind("H"),
    DISCONTINUOUS_FOLD: Kind("8"),
    MULTIPLE_CROSSING: Kind("*"),
    BOUNDARY_EQUILIBRIUM: Kind("o"),
    SURFACE_END: Kind("X"),
}
OTHER = Kind("o")


def kind_of(name: str) -> Kind:
    """The row of a kind; a plain one for a name that is not in the table."""
    return KINDS.get(name, OTHER)
