"""What all that is followed over a parameter has: two ends, each with a reason."""

from __future__ import annotations

from fmu_models.base.shown import Pictured


class Ended(Pictured):
    """A branch or a curve.

    Attributes:
        ends: Kind and a sentence, of both ends.
    """

    ends: tuple[tuple[str, str], tuple[str, str]]

    @property
    def named_ends(self) -> list[dict[str, str]]:
        """``ends`` with names."""
        return [{"kind": kind, "why": why} for kind, why in self.ends]

    @property
    def interrupted(self) -> bool:
        """Whether the keyboard ended it early."""
        return any(kind == "interrupted" for kind, _ in self.ends)
