"""Texts of others on a terminal: control characters are shown, not obeyed.

Names, descriptions, units and messages come out of FMUs, logs and files that anybody may have written. An escape
sequence in one clears or forges what stands on the screen, a mark of direction (U+202E) turns a file's name around, a
carriage return hides the line before it. They are written as Python and JSON write them: ``\\x1b``, ``\\u202e``.
"""

import json
import unicodedata
from collections.abc import Callable

# control characters, marks of format and direction, halves of characters, ends of lines and paragraphs
_COMMANDS = {"Cc", "Cf", "Cs", "Zl", "Zp"}


def printable(text: str) -> str:
    """A text of any number of lines with its control characters escaped."""
    return _escaped(text, lambda c: c.encode("unicode_escape").decode())


def in_line(text: str) -> str:
    """The text in one line: what separates words and lines is a space."""
    return text if text.isprintable() else printable("".join(" " if c.isspace() else c for c in text))


def printable_json(text: str) -> str:
    """JSON with those escaped that JSON itself leaves as they are; the same value."""
    return _escaped(text, lambda c: json.dumps(c)[1:-1])


def _escaped(text: str, escape: Callable[[str], str]) -> str:
    return "\n".join(
        line if line.isprintable() else "".join(escape(c) if _is_command(c) else c for c in line)
        for line in text.split("\n")
    )


def _is_command(character: str) -> bool:
    return unicodedata.category(character) in _COMMANDS and character != "\t"
