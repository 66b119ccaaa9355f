"""The lines of C that compute variations: derivatives of series along directions, linear in those of what they read."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

# series without a place of their own, which only other variations read
_SLOT = re.compile(r"[lb]->w\[\d+\]")


def varied(name: str) -> str:
    """What the variation of a series, parameter or speed of entry is called; what has none keeps its name.

    >>> varied("j->x[1]"), varied("p[0]")
    ('l->x[1]', 'l->p[0]')
    """
    return name.replace("j->", "l->") if name.startswith("j->") else f"l->{name}"


@dataclass
class Variations:
    """The body of one function: statements, or series with the expression of their coefficient k.

    ``moved``, the part that derivatives of parameters make, is left out where no direction has any.
    """

    lines: list[tuple[str, str, str]] = field(default_factory=list)

    def add(self, target: str, text: str, moved: str = "") -> None:
        """Coefficient k of a series."""
        self.lines.append((target, text, moved))

    def state(self, statement: str) -> None:
        """Something else, which may read any series."""
        self.lines.append(("", statement, ""))

    def statements(self, read: set[str]) -> list[str]:
        """C code, without the series that nobody reads."""
        statements = []
        for target, text, moved in self.lines:
            if not target:
                statements.append(text)
            elif target in read or not _SLOT.fullmatch(target):
                statements.append(f"{target}[k] = {text};")
                if moved:
                    statements.append(f"if (l->moved) {{ {target}[k] += {moved}; }}")
        return statements


def read_by(bodies: Iterable[Iterable[tuple[str, str, str]]]) -> set[str]:
    """The series without a place of their own on which others depend, however indirectly; of the lines of bodies."""
    series: set[str] = set()
    lines = [line for body in bodies for line in body]
    # a series is read after it is set, but for itself
    for target, text, moved in reversed(lines):
        if target in series or not _SLOT.fullmatch(target):
            series |= {name for name in _SLOT.findall(text + moved) if name != target}
    return series
