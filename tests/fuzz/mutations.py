"""Documents that are right but for a few places: numbers, texts, names and lines replaced, moved, doubled, left out."""

from __future__ import annotations

import random
import re

# what a place of a document may come to hold: out of range, of another type, too long, too deep, not text at all
NUMBERS = (
    *("0", "-1", "1", "-0.0", "nan", "inf", "-inf", "1e308", "-1e308", "1e-320", "0.1", "3", "1e5", "12345"),
    *("99999999999999999999999", "9" * 400, "0x1f", "1_0", "1,5", "1e", "true", "false", "null", "2147483648", "-7.5"),
)
TEXTS = (
    *('""', '" "', '"a"', '"nan"', '"1e400"', '"9**9**9"', '"mm("', '"mm/0"', '"kg m2"', '"rad"', '"5 %"', '"0 s"'),
    *('"../../x"', '"/dev/null"', '"x\\u0000y"', '"\u0660\u0661"', '"\\ud800"', '"' + "n" * 5000 + '"', '"%s%n"'),
    *(
        "'''",
        '"""',
        "[]",
        "{}",
        "[[]]",
        "[1, 2]",
        "{ a = 1 }",
        "[" * 3000,
        '"{{ x }}"',
        '"disc0"',
        '"1e-9 m"',
        "\ufeff",
    ),
)
TOKEN = re.compile(r'"[^"\n]*"|-?[\w.]+(?:[eE][-+]?\d+)?')


def mutated(text: str, generator: random.Random) -> str:
    """The text with one to four changes."""
    for _ in range(generator.choice((1, 1, 1, 2, 2, 4))):
        text = generator.choice((_replaced, _replaced, _replaced, _swapped, _lines, _noise))(text, generator)
    return text


def _replaced(text: str, generator: random.Random) -> str:
    """One token gives way to something nasty of its own kind, mostly."""
    found = list(TOKEN.finditer(text))
    if not found:
        return text
    token = generator.choice(found)
    quoted = token.group().startswith('"')
    kinds = [TEXTS, NUMBERS] if quoted else [NUMBERS, TEXTS]
    new = generator.choice(kinds[generator.random() < 0.2])
    if quoted and generator.random() < 0.5:
        # stays a text: an attribute of XML, a value of TOML
        inner = new.strip('"').replace('"', "")
        new = f'"{inner}"'
    return text[: token.start()] + new + text[token.end() :]


def _swapped(text: str, generator: random.Random) -> str:
    """One token takes the place of another."""
    found = list(TOKEN.finditer(text))
    if len(found) < 2:
        return text
    one, other = generator.choice(found), generator.choice(found)
    return text[: one.start()] + other.group() + text[one.end() :]


def _lines(text: str, generator: random.Random) -> str:
    """Lines, or the pieces between tags, are left out, doubled or moved."""
    parts = re.split(r"(?<=\n)|(?<=>)", text)
    begin = generator.randrange(len(parts))
    end = begin + generator.choice((1, 1, 1, 2, 5))
    taken = parts[begin:end]
    rest = parts[:begin] + parts[end:]
    how = generator.randrange(3)
    if how == 0:
        return "".join(rest)
    at = begin if how == 1 else generator.randrange(len(rest) + 1)
    return "".join(parts[:begin] + taken + taken + parts[end:] if how == 1 else rest[:at] + taken + rest[at:])


def _noise(text: str, generator: random.Random) -> str:
    """A few characters, or the end, are gone or others."""
    at = generator.randrange(len(text) + 1)
    how = generator.randrange(4)
    if how == 0:
        return text[:at]
    if how == 1:
        return text[:at] + text[at + generator.choice((1, 1, 3, 20)) :]
    stranger = generator.choice(
        ("\x00", "\ufffd", "<", ">", "&", '"', "'", "[", "]", "{", "}", "=", ",", ".", "\n", "\t")
    )
    return text[:at] + stranger + text[at + generator.randrange(2) :]
