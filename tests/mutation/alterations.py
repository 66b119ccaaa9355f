"""Mutants of a source file: one token of one line altered, Python by its syntax tree, C by its tokens.

Comparisons are negated, ``and`` and ``or``, sums and differences, products and quotients, least and greatest exchanged,
signs and negations dropped, small integers raised by one. Texts, annotations and named constants stay: a heading or a
tolerance that is doubled has no oracle but the code itself. So do a frozen class, the size of a picture and how far a
bar of progress is.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

_COMPARISONS = {
    ast.Lt: ("<", ">="),
    ast.LtE: ("<=", ">"),
    ast.Gt: (">", "<="),
    ast.GtE: (">=", "<"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
    ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
}
_BINARY = {ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.Pow: ("**", "*")}
_BOOLEAN = {ast.And: ("and", "or"), ast.Or: ("or", "and")}
_NAMES = {"min": "max", "max": "min", "any": "all", "all": "any", "sin": "cos", "cos": "sin"}
_NAMES |= {"floor": "ceil", "ceil": "floor", "fmin": "fmax", "fmax": "fmin", "minimum": "maximum", "maximum": "minimum"}
_LARGEST = 2  # integer that is altered: counts, indices, orders; larger ones are mostly sizes and limits
_UNSEEN_KEYWORDS = {"frozen", "eq", "kw_only", "slots", "figsize"}
_UNSEEN_CALLS = {"progress", "advance"}
# what a mutant must not reach for, outside of its copy of the tree
_SPARED = re.compile(r"kill|rmtree|unlink|rmdir|setrlimit")

_C_EXCHANGED = {"<": ">=", "<=": ">", ">": "<=", ">=": "<", "==": "!=", "!=": "==", "&&": "||", "||": "&&"}
_C_EXCHANGED |= {"+": "-", "-": "+", "*": "/", "/": "*", "+=": "-=", "-=": "+=", "*=": "/=", "/=": "*="}
_C_BINARY = re.compile(r"(?<=[\w)\]] )(<=|>=|==|!=|&&|\|\||[-+*/]=|[-+*/<>])(?= [\w(!*&+-])")
_C_UNARY = re.compile(r"(?<=[(,=?:] )-(?=[\w(])|(?<=[(\[])-(?=[\w(])|(?<=return )-(?=[\w(])|!(?=[\w(])")
_C_NAME = re.compile(r"\b(?:fmin|fmax|sin|cos|floor|ceil)(?=\()|\bfabs(?=\()|\b(?:true|false)\b")
_C_INTEGER = re.compile(r"(?<![\w.])[0-2](?![\w.])")
_C_NAMES = {**_NAMES, "fabs": "", "true": "false", "false": "true"}
_C_COMMENT = re.compile(
    r"/\*.*?\*/|//[^\n]*|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])*'|^[ \t]*#(?:\\\n|[^\n])*", re.S | re.M
)


@dataclass(frozen=True)
class Mutant:
    """One altered line.

    Attributes:
        file: path below the root of the tree, with '/'.
        line: number of the line, from 1.
        column: of the altered token, in characters from 0.
        stands: the line as it is.
        altered: the line as the mutant has it.
    """

    file: str
    line: int
    column: int
    stands: str
    altered: str

    def applied(self, text: str) -> str:
        """The text of the file with the altered line."""
        lines = text.split("\n")
        lines[self.line - 1] = self.altered
        return "\n".join(lines)

    @property
    def name(self) -> tuple[str, str, int, str]:
        """What it is called across changes of other lines."""
        return self.file, self.stands.strip(), self.column - _indent(self.stands), self.altered.strip()


def mutants(file: str, text: str) -> list[Mutant]:
    """All mutants of a file, by line and column."""
    lines = text.split("\n")
    alterations = _c_alterations(text) if file.endswith((".c", ".h")) else _python_alterations(text)
    result = []
    for line, column, before, after in sorted(set(alterations)):
        stands = lines[line - 1]
        if stands[column : column + len(before)] != before or _SPARED.search(stands):
            continue
        altered = stands[:column] + after + stands[column + len(before) :]
        result.append(Mutant(file, line, column, stands, altered))
    return result


def is_compiled(mutant: Mutant, text: str) -> bool:
    """Whether a mutant of a Python file compiles; whether one of C does is seen where it is built."""
    try:
        compile(mutant.applied(text), mutant.file, "exec")
    except SyntaxError:
        return False
    return True


_Alteration = tuple[int, int, str, str]  # line, column, token, token of the mutant


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def _python_alterations(text: str) -> Iterator[_Alteration]:
    lines = text.split("\n")

    def between(left: ast.expr, right: ast.expr, token: str) -> Iterator[tuple[int, int]]:
        """Where the operator stands, if no bracket or comment makes its line doubtful."""
        assert left.end_lineno is not None and left.end_col_offset is not None
        for number in range(left.end_lineno, right.lineno + 1):
            raw = lines[number - 1].encode()
            begin = left.end_col_offset if number == left.end_lineno else 0
            end = right.col_offset if number == right.lineno else len(raw)
            gap = raw[begin:end].decode().split("#")[0]
            found = re.search(rf"(?<!\w){re.escape(token)}(?!\w)" if token[0].isalpha() else re.escape(token), gap)
            if found:
                yield number, len(raw[:begin].decode()) + found.start()
                return

    for node in _expressions(ast.parse(text)):
        if isinstance(node, ast.Compare):
            for left, kind, right in zip([node.left, *node.comparators], node.ops, node.comparators, strict=False):
                before, after = _COMPARISONS[type(kind)]
                yield from ((*at, before, after) for at in between(left, right, before))
        elif isinstance(node, ast.BoolOp):
            for left, right in zip(node.values, node.values[1:], strict=False):
                before, after = _BOOLEAN[type(node.op)]
                yield from ((*at, before, after) for at in between(left, right, before))
        elif isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
            before, after = _BINARY[type(node.op)]
            yield from ((*at, before, after) for at in between(node.left, node.right, before))
        elif isinstance(node, ast.AugAssign) and type(node.op) in _BINARY:
            before, after = (f"{token}=" for token in _BINARY[type(node.op)])
            yield from ((*at, before, after) for at in between(node.target, node.value, before))
        else:
            column = len(lines[node.lineno - 1].encode()[: node.col_offset].decode())
            yield from ((node.lineno, column, *pair) for pair in _leaf(node))


def _leaf(node: ast.AST) -> Iterator[tuple[str, str]]:
    """Tokens that begin where their node begins."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        yield "not ", ""
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield "-", ""
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
        yield str(node.value), str(not node.value)
    elif isinstance(node, ast.Constant) and isinstance(node.value, int) and node.value <= _LARGEST:
        yield str(node.value), str(node.value + 1)
    elif isinstance(node, ast.Name) and node.id in _NAMES:
        yield node.id, _NAMES[node.id]
    elif isinstance(node, ast.Break):
        yield "break", "continue"
    elif isinstance(node, ast.Continue):
        yield "continue", "break"


def _expressions(tree: ast.AST) -> Iterator[Any]:
    """Nodes whose mutants a test could notice: no annotations, texts put together, messages, named constants."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.JoinedStr | ast.Raise):
            continue
        if isinstance(node, ast.keyword) and node.arg in _UNSEEN_KEYWORDS:
            continue
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _UNSEEN_CALLS:
            continue
        if isinstance(node, ast.Assign) and all(isinstance(t, ast.Name) and t.id.isupper() for t in node.targets):
            continue
        skipped: set[int] = set()
        for name in ("annotation", "returns"):
            if isinstance(annotation := getattr(node, name, None), ast.AST):
                skipped.add(id(annotation))
        if hasattr(node, "lineno"):
            yield node
        waiting.extend(child for child in ast.iter_child_nodes(node) if id(child) not in skipped)


def _c_alterations(text: str) -> Iterator[_Alteration]:
    blank = _C_COMMENT.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
    for number, line in enumerate(blank.split("\n"), 1):
        for match in _C_BINARY.finditer(line):
            if not _is_declarator(line, match):
                yield number, match.start(), match[0], _C_EXCHANGED[match[0]]
        for match in _C_UNARY.finditer(line):
            yield number, match.start(), match[0], ""
        for match in _C_NAME.finditer(line):
            yield number, match.start(), match[0], _C_NAMES[match[0]]
        if not re.match(r"\s*(?:static |extern )*const \w+ \w+(?:\[\w*\])* = \S+;\s*$", line):
            for match in _C_INTEGER.finditer(line):
                yield number, match.start(), match[0], str(int(match[0]) + 1)


def _is_declarator(line: str, match: re.Match[str]) -> bool:
    """Whether a star belongs to a type: 'const double * x'."""
    return (
        match[0] == "*"
        and re.search(r"(?:double|int|void|char|int\d+_t|struct \w+|const) $", line[: match.start()]) is not None
    )
