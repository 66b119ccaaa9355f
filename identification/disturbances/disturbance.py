"""A disturbance, declared once."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from identification.disturbances.term import DisturbanceTerm
from identification.measurement.pooled import Pool


@dataclass(frozen=True)
class Disturbance:
    """What a real bench adds to the law, or to what a sensor shows.

    Attributes:
        words: what happens, for reports and as the meaning of its terms.
        terms: (logs, size) -> its parameters for pooled logs; size: as an earlier fit found it, None if there is none.
        hidden: why pooled logs of one disc cannot show it, and what would; nothing where they can.
        rank: its terms stand after those of a lower rank.
        same_as: name of a disturbance that does the same in fewer terms, so that only one of the two is estimated.
        mimics: name of one with fewer terms that looks like it, in whose stead it is tried.
        remark: (logs, terms, their values if slips told them) -> what is said beside the words.
        told_by: what more would tell it from another that looks like it in some logs.
        evident: whether logs that can show it do, so that a contest may begin with it.
        unsettles: constants that are not known as stated where it acts, since a free decay was read without it.
        emulated: names in `rig_io.bench.disturbances.KINDS` that emulate it.
    """

    words: str
    terms: Callable[[Pool, float | None], Sequence[DisturbanceTerm]]
    hidden: Callable[[Pool], str] = lambda ready: ""
    rank: int = 100
    same_as: str = ""
    mimics: str = ""
    remark: Callable[[Pool, Sequence[DisturbanceTerm], Sequence[float]], str] = lambda ready, terms, values: ""
    told_by: str = ""
    evident: bool = False
    unsettles: tuple[str, ...] = ()
    emulated: tuple[str, ...] = ()
