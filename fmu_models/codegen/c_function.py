"""Functions of the generated C: their heads, and how long ones are cut."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby

_ARGUMENTS = "const Real *p, const Real *d, Jets *j, int k"
_VARIED = "const double *p, const double *d, const Jets *j, Variation *l, int k"
_DISCS = "const double *p, const double *d, const Jets *j, Jets *b"
_UNUSED = "    (void)p, (void)d, (void)j, (void)k;"
_UNUSED_VARIED = "    (void)p, (void)d, (void)j, (void)l, (void)k;"
_UNUSED_DISCS = "    (void)p, (void)d, (void)j, (void)b;"
# characters of the statements of one function
_MANY = 3000


def function(name: str, lines: Iterable[str]) -> str:
    """A function of model.h that computes one order of series."""
    return split(name, list(lines), f"void {name}({_ARGUMENTS})", _ARGUMENTS, "p, d, j, k", _UNUSED)


def varied_function(name: str, lines: list[str]) -> str:
    """The same of a variation."""
    return split(name, lines, f"static CALLED void {name}({_VARIED})", _VARIED, "p, d, j, l, k", _UNUSED_VARIED)


def disc_function(name: str, lines: list[str]) -> str:
    """The same of discs."""
    return split(name, lines, f"static CALLED void {name}({_DISCS})", _DISCS, "p, d, j, b", _UNUSED_DISCS)


def split(name: str, lines: list[str], head: str, parameters: str, arguments: str, unused: str) -> str:
    """A function of these statements; of many, one that calls their parts in turn: long ones take compilers minutes."""
    texts = []
    if sum(map(len, lines)) > _MANY:
        bodies = [list(group) for _, group in groupby(lines, key=_Counter(_MANY))]
        names = [f"KIND({name}_part_{i})" for i in range(len(bodies))]
        texts = [
            _definition(f"static CALLED void {callee}({parameters})", unused, body)
            for callee, body in zip(names, bodies, strict=True)
        ]
        lines = [f"{callee}({arguments});" for callee in names]
    return "\n".join([*texts, _definition(head, unused, lines)])


class _Counter:
    """The number of the part that a line belongs to, of parts of about so many characters."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._seen = 0

    def __call__(self, line: str) -> int:
        self._seen += len(line)
        return self._seen // self._size


def _definition(head: str, unused: str, lines: Iterable[str]) -> str:
    body = "\n".join(f"    {line}" for line in lines)
    return f"{head}\n{{\n{unused}\n{body}\n}}\n".replace("\n\n}", "\n}")


def by_contact(name: str, bodies: list[list[str]]) -> str:
    """One static function per contact, and the one of model.h that chooses among them."""
    texts = ["static " + function(f"KIND({name}_{i})", lines) for i, lines in enumerate(bodies)]
    calls = [f"KIND({name}_{i})(p, d, j, k)" for i in range(len(bodies))]
    texts.append(f"void model_{name}({_ARGUMENTS}, int c)\n{{\n{_UNUSED}\n{_choice(calls)}}}\n")
    return "\n".join(texts)


def varied_by_contact(name: str, bodies: list[list[str]]) -> str:
    """The same of variations."""
    texts = [varied_function(f"{name}_{i}_variation", lines) for i, lines in enumerate(bodies)]
    calls = [f"{name}_{i}_variation(p, d, j, l, k)" for i in range(len(bodies))]
    head = f"static CALLED void model_{name}_variation({_VARIED}, int c)"
    return "\n".join([*texts, f"{head}\n{{\n{_UNUSED_VARIED}\n{_choice(calls)}}}\n"])


def discs_by_contact(name: str, bodies: list[list[str]]) -> str:
    """The same of discs."""
    texts = [disc_function(f"{name}_{i}_disc", lines) for i, lines in enumerate(bodies)]
    calls = [f"{name}_{i}_disc(p, d, j, b)" for i in range(len(bodies))]
    head = f"static CALLED void model_{name}_disc({_DISCS}, int c)"
    return "\n".join([*texts, f"{head}\n{{\n{_UNUSED_DISCS}\n{_choice(calls)}}}\n"])


def _choice(calls: list[str]) -> str:
    """The call that belongs to contact c."""
    cases = "".join(f"    case {i}: {call}; break;\n" for i, call in enumerate(calls))
    return f"    switch (c) {{\n{cases}    default: break;\n    }}\n" if calls else "    (void)c;\n"
