"""How a text file of numbers is written: found from its first lines.

Lines above the table, a header of names, a line of units and the rows are told apart by their cells: a row has numbers
(or stamps) where the rows of the sample have them. Between two ways to part a line that one is taken which leaves more
cells that are numbers, then the one that gives more cells.
"""

import codecs
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from fmu_models.base.errors import StickslipError, refuse_unknown
from rig_io.logs import stamps

HEAD = 1 << 18  # bytes that are looked at
ROWS = 200  # of the sample that decide
BLANKS = r"\s+"  # as separator: any number of blanks and tabs
SEPARATORS = {"semicolon": ";", "tab": "\t", "comma": ",", "bar": "|", "blank": BLANKS}
MARKS = {"point": ".", "comma": ","}

# what recorders write where they have no number; the first are passed to pandas, the pattern knows all of them
NO_NUMBER = ["", "nan", "NaN", "NAN", "NA", "N/A", "null", "None"]
_NO_NUMBER = re.compile(
    r"([+-]?(1[.,]#(QNAN|SNAN|IND|INF)\d*|[qs]?nan(\(\w*\))?|inf(inity)?|over|overflow|overrange|underflow|ol)"
    r"|n/?a|#n/a|#num!|#value!|#div/0!|null|none|-+)?",
    re.IGNORECASE,
)
_NAME_AND_UNIT = re.compile(r"(?P<name>[^\[\]]*?)\s*(?:\[(?P<unit>[^\[\]]*)\])?")
_ROUND = re.compile(r"(?P<name>.*?\S)\s*[(](?P<unit>[^()]*)[)]")
_NUMBER = {
    ".": re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?"),
    ",": re.compile(r"[+-]?(\d+,?\d*|,\d+)([eEdD][+-]?\d+)?"),
}
_WORD = "text"


@dataclass(frozen=True)
class TextLayout:
    """How a file is written. separator: one character, or `BLANKS`; names of all columns and units stated; kinds: of
    each column, "number", "text" or a kind of stamp; first_line: of the first row (from 1); offset: of that row, in
    bytes; dates: "day" or "month", which stands first; notes: lines above the table."""

    encoding: str
    separator: str
    decimal: str
    names: tuple[str, ...]
    units: Mapping[str, str]
    kinds: tuple[str, ...]
    first_line: int
    offset: int
    nameless: bool
    doubled: tuple[str, ...]
    dates: str
    notes: tuple[str, ...]

    def cells(self, line: str) -> list[str]:
        """The cells of a line, without blanks and quotation marks around them."""
        return split(line, self.separator)


def split(line: str, separator: str) -> list[str]:
    """Cells of a line, without blanks and quotation marks around them."""
    if separator == BLANKS:
        return line.split()
    if '"' in line:
        line = unquoted(line, separator)
    return [cell.strip() for cell in line.split(separator)]


def unquoted(text: str, separator: str) -> str:
    """Without quotation marks; a separator within them becomes a point (of a number) or a blank."""

    def bare(match: re.Match[str]) -> str:
        inner = match[1]
        if separator not in inner:
            return inner
        return inner.replace(separator, "." if re.fullmatch(r"\s*[+-]?\d+,\d+([eE][+-]?\d+)?\s*", inner) else " ")

    return re.sub(r'"([^"\n]*)"', bare, text)


def is_none(cell: str) -> bool:
    """Whether a cell is empty, or a recorder's word for no number."""
    return _NO_NUMBER.fullmatch(cell) is not None


def is_number(cell: str, decimal: str = ".") -> bool:
    """Whether a cell is a number written with that decimal mark."""
    return _NUMBER[decimal].fullmatch(cell) is not None


def encoding_of(path: Path, head: bytes) -> str:
    """The encoding of a text by its byte-order mark or its bytes. StickslipError: the bytes are no text."""
    for mark, name in (
        (codecs.BOM_UTF8, "utf-8-sig"),
        (codecs.BOM_UTF16_LE, "utf-16"),
        (codecs.BOM_UTF16_BE, "utf-16"),
    ):
        if head.startswith(mark):
            return name
    zeros = head.count(0)
    if zeros:
        # of a text in UTF-16 without its mark every second byte is zero
        for name, offset in (("utf-16-le", 1), ("utf-16-be", 0)):
            if head[offset::2].count(0) > 0.9 * (len(head) // 2) and zeros < 0.6 * len(head):
                return name
        raise StickslipError(
            f"'{path}' holds zero bytes: a binary file. Give it the suffix of its kind, or save it as CSV in UTF-8."
        )
    odd = sum(byte < 32 and byte not in b"\t\n\r\f\v\x1a" for byte in head[:4096])
    if odd:
        raise StickslipError(f"'{path}' is no text: it holds {odd} control characters. Save it as CSV in UTF-8.")
    return "utf-8" if _decodes(head, "utf-8") else "cp1252" if _decodes(head, "cp1252") else "latin-1"


def _decodes(data: bytes, encoding: str) -> bool:
    try:
        codecs.getincrementaldecoder(encoding)().decode(data)  # a character cut off at the end is none of its faults
    except UnicodeDecodeError:
        return False
    return True


def layout_of(
    path: Path, head: bytes, complete: bool, encoding: str, options: Mapping[str, str], offset: int = 0
) -> TextLayout:
    """How a text is written. head: its first bytes; complete: whether that is all of it; options: what the user has
    said, "separator", "decimal", "header" (line of the names, from 1; 0: none), "dates". StickslipError: there is no
    table of numbers in it, or the header does not fit to it."""
    text = head.decode(encoding, errors="replace").removeprefix("\ufeff")
    lines = text.split("\n")
    if not complete and len(lines) > 1:
        lines.pop()
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise StickslipError(f"The log '{path}' is empty. Expected a header row with 'time' and rows of numbers.")
    lines = [line.rstrip("\r") for line in lines]
    separator, decimal = _parted(path, lines, options)
    rows = [split(line, separator) for line in lines]
    width, kinds = _columns(rows, decimal)
    # recorders end every line by a separator: a column of nothing
    first = next((i for i, row in enumerate(rows) if _fits(row, width, kinds, decimal)), None)
    if first is None or not width:
        raise StickslipError(
            f"'{path}' has a header but no rows of numbers: it begins with '{lines[0][:60].strip()}'. If there are, "
            "say how they are written: stickslip describe FILE --read separator=semicolon --read decimal=comma."
        )
    names, units, header = _header(path, rows, first, width, options, lines)
    nameless = not any(names)
    unique, doubled = _unique(names)
    before = "\n".join(text.split("\n")[:first])
    skipped = len((before + "\n").encode(encoding.removesuffix("-sig"))) if first else 0
    mark = len(codecs.BOM_UTF8) if encoding == "utf-8-sig" else 0
    dates = options.get("dates") or stamps.order_of(
        [row[j] for row in rows[first:] if len(row) == width for j in range(width) if kinds[j].startswith("date")]
    )
    return TextLayout(
        encoding,
        separator,
        decimal,
        tuple(unique),
        {unique[i]: unit for i, unit in units.items()},
        tuple(kinds),
        first + 1,
        offset + mark + skipped,
        nameless,
        doubled,
        dates or "month",
        tuple(line.strip() for line in lines[: header if header is not None else first] if line.strip()),
    )


def _parted(path: Path, lines: Sequence[str], options: Mapping[str, str]) -> tuple[str, str]:
    """Separator and decimal mark that leave most cells of the last lines as numbers."""
    sample = [line for line in lines[-ROWS:] if line.strip()]
    separators, marks = _asked(path, "separator", SEPARATORS, options), _asked(path, "decimal", MARKS, options)
    best, chosen = (0.0, 0.0), (separators[0], marks[0])
    for separator in separators:
        rows = [split(line, separator) for line in sample]
        width = Counter(map(len, rows)).most_common(1)[0][0]
        even = [row for row in rows if len(row) == width]
        for decimal in marks:
            if decimal == separator and len(separators) > 1:
                continue
            cells = [cell for row in even for cell in row]
            words = [cell for cell in cells if not is_number(cell, decimal) and not is_none(cell)]
            numbers = len(cells) - stamps.kinds_of(words).count(None)
            score = numbers / max(len(cells), 1) * len(even) / len(rows)
            if separator == "," and _is_one_number(even):
                score *= 0.5
            # a mark that is seen is preferred to one that is not needed
            seen = 0.5 if any(decimal in cell for cell in cells[: 20 * width]) else 0.0
            if (round(score, 2), width + seen) > best:
                best, chosen = (round(score, 2), width + seen), (separator, decimal)
    return chosen


def _asked(path: Path, name: str, choices: Mapping[str, str], options: Mapping[str, str]) -> list[str]:
    if name not in options:
        return list(choices.values())
    choice = options[name]
    if choice in choices.values():
        return [choice]
    refuse_unknown(choice, choices, f"'{path}': the {name} '{choice}' is unknown.")
    return [choices[choice]]


def _is_one_number(rows: Sequence[Sequence[str]]) -> bool:
    """Whether pairs of whole numbers are halves of one number with a decimal comma: second halves of one length, or
    with leading zeros."""
    if not rows or len(rows[0]) != 2 or not all(re.fullmatch(r"[+-]?\d+", a) and b.isdigit() for a, b in rows):
        return False
    lengths = {len(b) for _, b in rows}
    return (len(lengths) == 1 and len(rows) > 2 and lengths != {1}) or any(
        b.startswith("0") and b != "0" for _, b in rows
    )


def _columns(rows: Sequence[Sequence[str]], decimal: str) -> tuple[int, list[str]]:
    """Number of cells of a row, and what each column holds, by the last rows."""
    last = [row for row in rows[-ROWS:] if any(row)]
    width = Counter(map(len, last)).most_common(1)[0][0] if last else 0
    # of two or three lines the table is at the end
    if len(last) <= 3:
        width = len(last[-1])
    even = [row for row in last if len(row) == width]
    return width, [_kind([row[j] for row in even], decimal) for j in range(width)]


def _kind(cells: Sequence[str], decimal: str) -> str:
    filled = [cell for cell in cells if not is_none(cell)]
    # a few words above a column of words for no number are its header
    if len(filled) < 0.1 * len(cells) or not filled:
        return "number" if sum(map(bool, cells)) > len(filled) else "empty"
    if sum(is_number(cell, decimal) for cell in filled) >= 0.5 * len(filled):
        return "number"
    kind, number = Counter(kind or _WORD for kind in stamps.kinds_of(filled)).most_common(1)[0]
    return kind if number >= 0.5 * len(filled) else _WORD


def _fits(row: Sequence[str], width: int, kinds: Sequence[str], decimal: str) -> bool:
    """Whether a line is a row of the table: most cells are what their columns hold."""
    if len(row) != width:
        return False
    ours = [(cell, kind) for cell, kind in zip(row, kinds, strict=True) if kind not in (_WORD, "empty")]
    good = [is_number(c, decimal) if kind == "number" else stamps.kinds_of([c]) == [kind] for c, kind in ours]
    none = [is_none(cell) for cell, _ in ours]
    return any(good) and sum(g or n for g, n in zip(good, none, strict=True)) > 0.5 * len(ours)


def _header(
    path: Path, rows: list[list[str]], first: int, width: int, options: Mapping[str, str], lines: Sequence[str]
) -> tuple[list[str], dict[int, str], int | None]:
    """Names of the columns ("" where there is none), units by place, and the line (from 0) of the header if any."""
    index: int | None = first - 1
    if "header" in options:
        if not options["header"].isdigit() or int(options["header"]) > first:
            raise StickslipError(
                f"'{path}': the header is said to be on line {options['header']}, but rows begin on line {first + 1}. "
                "Give the number of a line above, or 0 for none."
            )
        index = int(options["header"]) - 1
    while index is not None and index >= 0 and not any(rows[index]) and "header" not in options:
        index -= 1
    if index is None or index < 0:
        return [""] * width, {}, None
    cells, units = _padded(rows[index], width), {}
    above = index - 1
    if "header" not in options and above >= 0 and _are_units(cells) and (upper := _padded(rows[above], width)):
        units, cells, index = _units(cells), upper, above
    elif "header" in options and index + 1 < first and (below := _padded(rows[index + 1], width)) and _are_units(below):
        units = _units(below)
    if not cells:
        if len(rows[index]) > 1 and len(rows[index]) > 0.4 * width and all(not is_number(c) for c in rows[index] if c):
            raise _uneven(path, rows, index, first)
        return [""] * width, {}, None
    if "header" not in options and width == 1 and first > 1 and " " in cells[0] and ":" in cells[0]:
        return [""], {}, None  # a remark above a single column
    names = []
    for i, cell in enumerate(cells):
        name, unit = unit_of(cell)
        if unit is not None and (i not in units or "[" in cell):
            units[i] = unit
        names.append(name if unit is not None or i not in units else cell)
    return names, units, index


def unit_of(cell: str) -> tuple[str, str | None]:
    """Name and unit of a header cell such as "name [unit]" or "name (unit)"; None where it states none."""
    match = _NAME_AND_UNIT.fullmatch(cell)
    if match and match["unit"] is not None:
        return match["name"].strip(), match["unit"]
    in_brackets = _ROUND.fullmatch(cell)
    if in_brackets and unit_like(in_brackets["unit"]):
        return in_brackets["name"], in_brackets["unit"]
    return cell.strip(), None


def _padded(cells: list[str], width: int) -> list[str]:
    """Cells of a header or a line of units, as many as columns; none if they do not fit."""
    if len(cells) == width:
        return cells
    if len(cells) == width + 1 and not cells[-1]:
        return cells[:-1]
    return [*cells, ""] if len(cells) == width - 1 and len(cells) > 1 else []


def _are_units(cells: Sequence[str]) -> bool:
    """Whether all cells of a line can be units (that of a count may be 1, - or left out), and one of them is."""
    bare = [cell.strip("[]() ") for cell in cells]
    return bool(set(bare) - {"", "1", "-"}) and all(unit in ("", "1", "-") or unit_like(unit) for unit in bare)


def _units(cells: Sequence[str]) -> dict[int, str]:
    return {i: "1" if c.strip("[]() ") in ("", "-") else c.strip("[]() ") for i, c in enumerate(cells)}


# words that pint takes for units but that head columns
_NO_UNITS = {"time", "count", "counts", "t", "angle", "speed", "force", "x", "y", "v", "laser", "position", "drive"}


def unit_like(text: str) -> bool:
    """Whether a text is a unit."""
    if not text or len(text) > 12 or is_number(text) or text.lower() in _NO_UNITS - {"t", "v"}:
        return False
    from fmu_models.base.unit_names import parse_unit

    try:
        parse_unit(text.replace("µ", "u").replace("μ", "u"))
    except (ValueError, ArithmeticError):
        return False
    return True


def _unique(names: Sequence[str]) -> tuple[list[str], tuple[str, ...]]:
    """Names that differ: nameless columns by their place, doubled ones with a number; and the doubled ones."""
    unique: list[str] = []
    for i, name in enumerate(names):
        base = name or f"column {i + 1}"
        number, candidate = 1, base
        while candidate in unique:
            number += 1
            candidate = f"{base} ({number})"
        unique.append(candidate)
    return unique, tuple(name for name, times in Counter(n for n in names if n).items() if times > 1)


def _uneven(path: Path, rows: Sequence[Sequence[str]], header: int, first: int) -> StickslipError:
    advice = "Name every column, or say which line holds the names: stickslip describe FILE --read header=LINE."
    if len(rows[first]) >= 2 * len(rows[header]) - 1:
        advice = "A comma as decimal mark needs ';' between cells, or use a decimal point."
    return StickslipError(
        f"'{path}': line {first + 1} has {len(rows[first])} cells, the header has {len(rows[header])}. {advice}"
    )
