"""Functions of the generated C: their heads, and how long ones are cut."""

import re
from collections.abc import Iterable, Sequence
from itertools import accumulate, groupby
from typing import Any, NamedTuple

from fmu_models.codegen.loops import ALIKE, rolled, rows_of, shape, static_table

# characters of the statements of one function
_MANY = 3000


class FunctionKind(NamedTuple):
    """A kind of function: what its name ends in, and what stands before ``void`` in the text of one."""

    parameters: str
    suffix: str = ""
    storage: str = ""

    def function(self, name: str, lines: list[str]) -> str:
        """The function of a name."""
        return split(f"{name}{self.suffix}", lines, f"{self.storage}void {name}{self.suffix}({self.parameters})")

    def by_contact(self, name: str, bodies: list[list[str]]) -> str:
        """One static function per contact, or per many whose bodies have one shape, and the one that chooses among
        them."""
        alike: dict[str, list[int]] = {}
        for i, lines in enumerate(bodies):
            alike.setdefault(shape("\n".join(lines)), []).append(i)
        groups = [g for group in alike.values() for g in ([group] if len(group) >= ALIKE else ([i] for i in group))]
        texts, calls = [], {}
        for group in sorted(groups):
            rows = rows_of(["\n".join(bodies[i]) for i in group], "its", "own")
            names = {its: self._part(f"{name}_{group[0]}_{its}") for _, its, _ in rows.tables}
            further = "".join(f", const {kind} *{its}" for kind, its, _ in rows.tables)
            part = self._part(f"{name}_{group[0]}")
            head = f"{self.storage or 'static '}void {part}({self.parameters}{further})"
            texts += [static_table(kind, names[its], values) for kind, its, values in rows.tables]
            texts.append(split(f"{name}_{group[0]}{self.suffix}", rows.text.splitlines(), head))
            for row, i in enumerate(group):
                own = "".join(f", {table}[{row}]" for table in names.values())
                calls[i] = f"    case {i}: {part}({_names(self.parameters)}{own}); break;\n"
        whole = f"{self.storage}void model_{name}{self.suffix}({self.parameters}, int c)"
        cases = [calls[i] for i in sorted(calls)]
        return "\n".join([*texts, _definition(whole, self.parameters, _switch(cases) or ["(void)c;"])])

    def _part(self, name: str) -> str:
        return f"{name}{self.suffix}" if self.suffix else f"KIND({name})"


SERIES = FunctionKind("const Real *p, const Real *d, Jets *j, int k")
VARIATION = FunctionKind(
    "const double *p, const double *d, const Jets *j, Variation *l, int k", "_variation", "static CALLED "
)
DISC = FunctionKind("const double *p, const double *d, const Jets *j, Jets *b", "_disc", "static CALLED ")


def split(name: str, lines: list[str], head: str) -> str:
    """A function of these statements; of many, one that calls their parts in turn: long ones take compilers minutes."""
    texts, parameters = [], head.rpartition("(")[2].removesuffix(")")
    lines = rolled(lines)
    if sum(map(len, lines)) > _MANY:
        totals = accumulate(map(len, lines))
        groups = groupby(zip(lines, totals, strict=True), key=lambda pair: pair[1] // _MANY)
        bodies = [[line for line, _ in group] for _, group in groups]
        names = [f"KIND({name}_part_{i})" for i in range(len(bodies))]
        texts = [
            _definition(f"static CALLED void {callee}({parameters})", parameters, body)
            for callee, body in zip(names, bodies, strict=True)
        ]
        lines = [f"{callee}({_names(parameters)});" for callee in names]
    return "\n".join([*texts, _definition(head, parameters, lines)])


def table(kind: str, name: str, size: str, values: Iterable[Any], none: str = "0") -> str:
    """An array of the model; ``none`` stands where there are no values."""
    return f"{kind} model_{name}[{size}] = {{{', '.join(map(str, values)) or none}}};"


def by_case(head: str, cases: Sequence[str], *end: str) -> str:
    """A function of contact c by its cases, and the statements behind them."""
    return _definition(head, head.rpartition("(")[2].removesuffix(")"), [*_switch(cases), *end])


def _switch(cases: Sequence[str]) -> list[str]:
    return [f"switch (c) {{\n{''.join(cases)}    default: break;\n    }}"] if cases else []


def _names(parameters: str) -> str:
    return ", ".join(re.findall(r"\w+(?=,|$)", parameters))


def _definition(head: str, parameters: str, lines: Iterable[str]) -> str:
    unused = ", ".join(f"(void){name}" for name in _names(parameters).split(", "))
    body = "\n".join(f"    {line}" for line in lines)
    return f"{head}\n{{\n    {unused};\n{body}\n}}\n".replace("\n\n}", "\n}")
