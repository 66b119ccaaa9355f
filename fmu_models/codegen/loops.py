"""Statements of one shape as loops over tables: what many equal bodies do compiles in the time of one of them.

    j->a[1][k] = d[3] * j->x[0][k] + d[3] * j->x[2][k];       static const int at[][2] = {{0, 2}, {1, 3}, ...};
    j->a[2][k] = d[3] * j->x[1][k] + d[3] * j->x[3][k];  ->   for (int n = 0; n < ...; n++) { j->a[1 + n][k] =
    ...                                                           d[3] * j->x[at[n][0]][k] + d[3] * j->x[at[n][1]][k]; }

The shape of a statement is its text without indices and numbers. Statements keep their order where one reads what
another sets, and sums that of their terms: results have the same bits. Fewer than ``ALIKE`` stay as they are.
"""

import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

# statements of one shape, or terms of one sum, from which on a loop is written
ALIKE = 16
_VALUE = re.compile(r"(?<=\[)\d+(?=\])|(?<![\w.\[])\d+\.\d+(?:e[-+]?\d+)?|(?<![\w.\[])\d+e[-+]?\d+")
_NAME = re.compile(r"\b[jlb]->\w+(?:\[\d+\])*|\bd\[\d+\]")
# what a statement sets, where it sets one quantity
_TARGET = re.compile(
    r"(?:if \(l->moved\) \{ )?([jlb]->\w+(?:\[\d+\])*|d\[\d+\])(?:\[k\])? [-+]?= |disc_\w+\((b->[^,]+), "
)
_SUM = re.compile(r"(\S+) = (.*);")
_SIGN = re.compile(r" ([-+]) ")


class Rows(NamedTuple):
    """Statements of one shape.

    Attributes:
        text: of each, where what differs is read from the row of a table.
        tables: type, name and rows of the tables, of integers and of numbers; only those with columns.
    """

    text: str
    tables: list[tuple[str, str, list[tuple[str, ...]]]]


def shape(text: str) -> str:
    """A text without its indices and numbers."""
    return _VALUE.sub("#", text)


def rows_of(texts: Sequence[str], integers: str, numbers: str) -> Rows:
    """One text for several of one shape; ``integers`` and ``numbers`` name the tables."""
    columns: dict[tuple[str, str], list[tuple[str, ...]]] = {("int", integers): [], ("double", numbers): []}
    values = []
    for column in zip(*map(_VALUE.findall, texts), strict=True):
        if len(set(column)) == 1:
            values.append(column[0])
            continue
        kind = ("int", integers) if column[0].isdigit() else ("double", numbers)
        if column not in columns[kind]:
            columns[kind].append(column)
        values.append(f"{kind[1]}[{columns[kind].index(column)}]")
    ordered = iter(values)
    text = _VALUE.sub(lambda _: next(ordered), texts[0])
    return Rows(text, [(*kind, list(zip(*of, strict=True))) for kind, of in columns.items() if of])


def static_table(kind: str, name: str, rows: Sequence[Sequence[str]]) -> str:
    """The definition of a table in one file or function."""
    text = ", ".join(f"{{{', '.join(row)}}}" for row in rows)
    return f"static const {kind} {name}[{len(rows)}][{len(rows[0])}] = {{{text}}};"


def rolled(lines: list[str]) -> list[str]:
    """Statements of a function body, those of one shape in loops."""
    if len(lines) < ALIKE and all(len(line) < 10 * ALIKE for line in lines):
        return lines
    groups: dict[tuple[int, str], list[str]] = {}
    for level, line in zip(_levels(lines), lines, strict=True):
        groups.setdefault((level, shape(line)), []).append(line)
    if len(lines) >= ALIKE and max(map(len, groups.values())) < ALIKE:
        return [_rolled_sum(line) for line in lines]
    result = []
    for _, group in sorted(groups.items(), key=lambda item: item[0][0]):
        result += [_loop(group)] if len(group) >= ALIKE else [_rolled_sum(line) for line in group]
    return result


def _levels(lines: Iterable[str]) -> list[int]:
    """Of every statement the number of others that must come before it, one after the other."""
    levels, written, read = [], dict[str, int](), dict[str, int]()
    floor = highest = 0
    for line in lines:
        target = _TARGET.match(line)
        if target is None:  # it may read and set anything
            level = floor = highest + 1
        else:
            own, names = target[1] or target[2], _NAME.findall(line)
            level = max(floor, read.get(own, -1), *(written.get(name, -1) for name in names)) + 1
            written[own] = level
            for name in names:
                read[name] = max(level, read.get(name, -1))
        highest = max(highest, level)
        levels.append(level)
    return levels


def _loop(texts: Sequence[str]) -> str:
    rows = rows_of(texts, "at[n]", "of[n]")
    statics = "".join(f"{static_table(kind, name.removesuffix('[n]'), of)} " for kind, name, of in rows.tables)
    return f"{{ {statics}for (int n = 0; n < {len(texts)}; n++) {{ {rows.text} }} }}"


def _rolled_sum(line: str) -> str:
    """A statement; if it is a long sum, one loop for terms of one shape that stand together."""
    match = _SUM.fullmatch(line)
    if match is None or line.count(" + ") + line.count(" - ") < ALIKE:
        return line
    target, text = match.groups()
    terms = _terms(text)
    result, start = [f"{target} = {terms[0]};"], 1
    statements = [f"{target} {sign}= {term};" for sign, term in zip(terms[1::2], terms[2::2], strict=True)]
    while start <= len(statements):
        end = start
        while end < len(statements) and shape(statements[end]) == shape(statements[start - 1]):
            end += 1
        group = statements[start - 1 : end]
        result += [_loop(group)] if len(group) >= ALIKE else group
        start = end + 1
    return " ".join(result)


def _terms(text: str) -> list[str]:
    """The terms of a sum and, between them, their signs."""
    parts = _SIGN.split(text)
    terms = [parts[0]]
    for sign, part in zip(parts[1::2], parts[2::2], strict=True):
        if terms[-1].count("(") == terms[-1].count(")"):
            terms += [sign, part]
        else:
            terms[-1] += f" {sign} {part}"
    return terms
