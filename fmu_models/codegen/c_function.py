"""Functions of the generated C: their heads, and how long ones are cut."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import accumulate, groupby
from typing import NamedTuple

# characters of the statements of one function
_MANY = 3000


class Kind(NamedTuple):
    """A kind of function: what its name ends in, and what stands before ``void`` in the text of one."""

    parameters: str
    arguments: str
    suffix: str = ""
    storage: str = ""

    def function(self, name: str, lines: list[str]) -> str:
        """The function of a name."""
        return self._of(f"{name}{self.suffix}", self.storage, lines)

    def by_contact(self, name: str, bodies: list[list[str]]) -> str:
        """One static function per contact, and the one that chooses among them."""
        parts = [f"{name}_{i}{self.suffix}" if self.suffix else f"KIND({name}_{i})" for i in range(len(bodies))]
        texts = [self._of(part, self.storage or "static ", lines) for part, lines in zip(parts, bodies, strict=True)]
        cases = "".join(f"    case {i}: {part}({self.arguments}); break;\n" for i, part in enumerate(parts))
        choice = f"switch (c) {{\n{cases}    default: break;\n    }}" if parts else "(void)c;"
        head = f"{self.storage}void model_{name}{self.suffix}({self.parameters}, int c)"
        return "\n".join([*texts, _definition(head, self.arguments, [choice])])

    def _of(self, name: str, storage: str, lines: list[str]) -> str:
        return split(name, lines, f"{storage}void {name}({self.parameters})", self.parameters, self.arguments)


SERIES = Kind("const Real *p, const Real *d, Jets *j, int k", "p, d, j, k")
VARIATION = Kind(
    "const double *p, const double *d, const Jets *j, Variation *l, int k",
    "p, d, j, l, k",
    "_variation",
    "static CALLED ",
)
DISC = Kind("const double *p, const double *d, const Jets *j, Jets *b", "p, d, j, b", "_disc", "static CALLED ")


def split(name: str, lines: list[str], head: str, parameters: str, arguments: str) -> str:
    """A function of these statements; of many, one that calls their parts in turn: long ones take compilers minutes."""
    texts = []
    if sum(map(len, lines)) > _MANY:
        totals = accumulate(map(len, lines))
        groups = groupby(zip(lines, totals, strict=True), key=lambda pair: pair[1] // _MANY)
        bodies = [[line for line, _ in group] for _, group in groups]
        names = [f"KIND({name}_part_{i})" for i in range(len(bodies))]
        texts = [
            _definition(f"static CALLED void {callee}({parameters})", arguments, body)
            for callee, body in zip(names, bodies, strict=True)
        ]
        lines = [f"{callee}({arguments});" for callee in names]
    return "\n".join([*texts, _definition(head, arguments, lines)])


def _definition(head: str, arguments: str, lines: Iterable[str]) -> str:
    unused = ", ".join(f"(void){argument}" for argument in arguments.split(", "))
    body = "\n".join(f"    {line}" for line in lines)
    return f"{head}\n{{\n    {unused};\n{body}\n}}\n".replace("\n\n}", "\n}")
