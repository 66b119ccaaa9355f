"""The C of W, G and the mass matrix, and tables of where they are not zero."""

import re
from collections.abc import Iterable, Mapping

import sympy

from fmu_models.codegen.c_function import table
from fmu_models.codegen.jets import Recurrences
from fmu_models.lowering.hybrid_system import HybridSystem, acting, joined, only_parameters

# zeros of W and G that are written one by one; more of them by a loop, or the compiler takes minutes
_FEW = 100
_CLEAR_INERTIA = [
    f"for (int i = 0; i < MODEL_{rows}; i++) {{ for (int c = 0; c < MODEL_NC; c++) {{ j->{letter}[i][c][k] = 0.0; }} }}"
    for letter, rows in (("W", "NV"), ("G", "NC"))
]
_FACTOR = "if (k == 0) { mass_factor(j->M, j->factor); }"


def assign_inertia(system: HybridSystem, result: Recurrences, W: Mapping[sympy.Basic, str]) -> Recurrences:
    """W and G; with a mass matrix that is factored here, it comes first, and W and G from it."""
    zeros = len(system.driven) * len(system.contacts) + len(system.contacts) ** 2
    zeros -= len(system.W.todok()) + len(system.G.todok())
    sparse = zeros > max((len(system.W) + len(system.G)) / 2, _FEW) or bool(system.inertia)
    if sparse:
        result.lines += _CLEAR_INERTIA
        for line in _CLEAR_INERTIA:
            result.variations.state(line.replace("j->", "l->").replace("0.0;", "PAIR_ZERO;"))
            result.discs.state(re.sub(r"j->(.*)\[k\] = 0.0;", r"disc_zero(b->\1);", line))
    if not system.inertia:
        for matrix, letter in ((system.W, "W"), (system.G, "G")):
            entries = matrix.todok() if sparse else {divmod(i, matrix.cols): e for i, e in enumerate(matrix.flat())}
            for (row, column), entry in sorted(entries.items()):
                result.assign(f"j->{letter}[{row}][{column}]", entry)
        return result
    for index, (row, column) in enumerate(envelope(system)):
        result.assign(f"j->M[{index}]", system.inertia.get((row, column), sympy.S.Zero))
    result.lines.append(_FACTOR)
    levers = system.W.todok()
    for (row, column), lever in sorted(levers.items()):
        result.assign(f"j->W[{row}][{column}]", lever)
    for c in range(len(system.contacts)):
        solve(result, f"W[0][{c}]", "W")
    symbols = {name: symbol for symbol, name in W.items()}
    for c, e in sorted(joined(system)):
        if e <= c:
            # of the blocks of M that row c is part of, e may act on some alone
            shares = [(lever, symbols.get(f"j->W[{i}][{e}]")) for (i, at), lever in levers.items() if at == c]
            rate = [lever * share for lever, share in shares if share is not None]
            result.assign(f"j->G[{c}][{e}]", sympy.Add(*rate))
            if e < c:
                result.lines.append(f"j->G[{e}][{c}][k] = j->G[{c}][{e}][k];")
                result.variations.state(f"l->G[{e}][{c}][k] = l->G[{c}][{e}][k];")
                result.discs.sum(f"j->G[{e}][{c}]", {f"j->G[{c}][{e}]": "1.0"})
    return result


def solve(result: Recurrences, first: str, series: str) -> None:
    """The statement that turns generalised forces, in the place of their accelerations, into these."""
    stride = f"(int)(sizeof j->{series}[0] / sizeof(Real))"
    result.lines.append(f"mass_solve(j->M, j->factor, j->{first}, {stride}, k);")
    stride = f"(int)(sizeof j->{series}[0] / sizeof(double))"
    result.discs.state(f"disc_mass_solve(j->M, b->M, j->factor, j->{first}, b->{first}, {stride});")
    result.variations.state(f"pair_mass_solve(j->M, l->M, j->factor, j->{first}, l->{first}, {stride}, k);")


def envelope(system: HybridSystem) -> list[tuple[int, int]]:
    """Rows and columns of the entries of the mass matrix that are kept, row by row."""
    first = {}
    for row, column in system.inertia:
        first[row] = min(first.get(row, row), column)
    return [(row, column) for row in sorted(first) for column in range(first[row], row + 1)]


def sparsity(system: HybridSystem) -> list[str]:
    """Tables of what is not zero: of the mass matrix, of W and of G."""
    entries = envelope(system)
    first = {row: column for row, column in reversed(entries)}
    start = {row: index - column for index, (row, column) in reversed(list(enumerate(entries)))}
    moves = [not only_parameters([system.inertia.get(entry, sympy.S.Zero)]) for entry in entries]
    n = len(system.driven)

    def rows(name: str, count: int, size: str, entries: Iterable[tuple[int, int]]) -> list[str]:
        columns: list[list[int]] = [[] for _ in range(count)]
        for row, column in sorted(entries):
            columns[row].append(column)
        starts = [sum(map(len, columns[:row])) for row in range(count + 1)]
        return [
            table("const int", f"{name}_first", f"{size} + 1", starts),
            table("const int", name, "", [column for row in columns for column in row]),
        ]

    return [
        table("const int", "mass_first", "MODEL_ROOM(MODEL_NV)", (first.get(row, 0) for row in range(n))),
        table("const int", "mass_row", "MODEL_ROOM(MODEL_NV)", (start.get(row, 0) for row in range(n))),
        table("const unsigned char", "mass_moves", "MODEL_ROOM(MODEL_NM)", map(int, moves)),
        *rows("acting", n, "MODEL_NV", acting(system)),
        *rows("joined", len(system.contacts), "MODEL_NC", joined(system)),
        "",
    ]
