"""The one error a user is meant to read, and the hint that goes with a misspelt name."""

import difflib
from collections.abc import Collection, Iterable
from typing import Protocol, TypeVar


class _Named(Protocol):
    @property
    def name(self) -> str: ...


N = TypeVar("N", bound=_Named)


class StickslipError(Exception):
    """Something the user can mend: says what was found, what was expected and what to do."""


class WriteError(StickslipError):
    """A file that could not be written to its end, through no fault of what was asked for: a disk that is full."""


class StickslipWarning(UserWarning):
    """Something in what was read that was mended or left aside and that the user should know of."""


def nearest(name: str, names: Iterable[str]) -> str:
    """Sentence with the known name closest to a misspelt one, or all of them where none is close.

    >>> nearest("dics_rig", ["disc_rig", "block_on_belt"])
    " Did you mean 'disc_rig'?"
    """
    choices = list(names)
    close = difflib.get_close_matches(name, choices, n=1, cutoff=0.5)
    if close:
        return f" Did you mean '{close[0]}'?"
    return f" Known are: {', '.join(choices)}." if choices else ""


def refuse_unknown(name: str, names: Collection[str], sentence: str) -> None:
    """Refuse a name that is not among those known. StickslipError: the sentence, and the known name closest to it."""
    if name not in names:
        raise StickslipError(f"{sentence}{nearest(name, names)}")


def named(items: Iterable[N], name: str, sentence: str) -> N:
    """The item of a name; errors as for `refuse_unknown`."""
    by_name = {item.name: item for item in items}
    refuse_unknown(name, by_name, sentence)
    return by_name[name]
