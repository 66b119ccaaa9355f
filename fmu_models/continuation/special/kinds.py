"""Kinds of special points in one table: what else knows a kind asks here.

At a smooth point a multiplier passes +1, -1 or, in a pair, the circle: its test, its curve in two parameters and its
normal form follow from that. A new kind is a row, and a file beside this one that locates it.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class PointKind:
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


# in the order of legends
KINDS: dict[str, PointKind] = {}


def _row(name: str, *columns: str, crosses: bool = False, supercritical: int = 0, degenerate: str = "") -> str:
    KINDS[name] = PointKind(*columns, crosses=crosses, supercritical=supercritical, degenerate=degenerate)
    return name


FOLD = _row("fold", "s", "+1")
FLIP = _row("flip", "D", "-1", supercritical=1, degenerate="generalized flip")
NEIMARK_SACKER = _row("Neimark-Sacker", "*", "circle", supercritical=-1, degenerate="Chenciner")
PITCHFORK = _row("pitchfork", "P", "+1", crosses=True, supercritical=-1, degenerate="degenerate pitchfork")
BRANCH_POINT = _row("branch point", "p", "+1", crosses=True)
HOPF = _row("Hopf", "h", "circle", supercritical=-1, degenerate="Bautin")
COMPLIANT_GRAZING = _row("grazing, compliant", "o")
RIGID_GRAZING = _row("grazing, rigid", "v")
GRAZING = _row("grazing", "o")
CORNER = _row("grazing-sliding corner", "^")
TOUCH = _row("touch", "<")
EXCHANGE = _row("sliding exchange", ">")
DETACHMENT = _row("detachment", "o")
CROSSING_SLIDING = _row("crossing-sliding", "<")
BORDER_COLLISION = _row("border collision", "v")
TIE = _row("tie", "v")
JUMP = _row("jump", "X")
HOMOCLINIC = _row("homoclinic", "h")
PARENT_FLIP = _row("flip of the parent", "d", "+1", crosses=True)
DISCONTINUOUS_HOPF = _row("discontinuous Hopf", "H")
DISCONTINUOUS_FOLD = _row("discontinuous fold", "8")
MULTIPLE_CROSSING = _row("multiple crossing", "*")
BOUNDARY_EQUILIBRIUM = _row("boundary equilibrium", "o")
SURFACE_END = _row("end at a surface", "X")


def kind_of(name: str) -> PointKind:
    """The row of a kind; a plain one for a name that is not in the table."""
    return KINDS.get(name, PointKind("o"))
