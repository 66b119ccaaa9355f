"""No text of somebody else is a command to the terminal, in a table, a line, an error or JSON."""

from __future__ import annotations

import io
import json
import re
import unicodedata

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.base.printable import in_line, printable, printable_json
from fmu_models.base.printable_console import PrintableConsole
from fmu_models.base.shown import Shown
from fmu_models.base.table import Cell, table

EVIL = [
    *("\x1b[2J", "\x1b]0;title\x07", "\x9b31m", "a\rb", "\x08\x08", "\x7f", "\u202egpj.exe", "\u2066", "\u200b"),
    *("\ufeff", "\u2028", "\ud800", "\U000e0041", "[link=http://x]y[/link]", "[/bold]", "</script><b>", "\0"),
]
foreign = st.one_of(st.text(), st.lists(st.sampled_from(EVIL) | st.text(max_size=4)).map("".join))


def commands(text: str, kept: str = "\n\t") -> set[str]:
    """Characters that a terminal or a reader may obey; written here once more, by the tables of Unicode."""
    marks = {"\u061c", "\u200e", "\u200f", *map(chr, range(0x202A, 0x202F)), *map(chr, range(0x2066, 0x206A))}
    return {c for c in text if (unicodedata.category(c) in ("Cc", "Cf", "Cs", "Zl", "Zp") or c in marks)} - set(kept)


@given(foreign)
def test_a_text_loses_its_commands_and_nothing_else(text):
    shown = printable(text)
    assert not commands(shown) and printable(shown) == shown
    assert not commands(in_line(text), kept="")
    kept = [c for c in text if c not in commands(text)]
    assert [c for c in text if c in shown or c not in kept] == list(text)
    if not commands(text):
        assert shown == text


@pytest.mark.parametrize("text", ["mu_s ± 0,1 N·m²", "Reibung größer ≤ 3", "摩擦", "a\u00a0b\u202fc", "line\nline\tx"])
def test_what_people_write_stays(text):
    assert printable(text) == text


@given(st.dictionaries(foreign, foreign | st.floats(allow_nan=False), max_size=3))
def test_json_keeps_its_value(value):
    text = printable_json(json.dumps(value, indent=2, ensure_ascii=False))
    assert json.loads(text) == value and not commands(text)


@settings(max_examples=40)
@given(foreign, st.booleans())
def test_nothing_passes_the_console(text, is_terminal):
    """As a line, a table of texts or of cells and a title; of what rich adds there are colours alone."""
    file = io.StringIO()
    out = PrintableConsole(file=file, force_terminal=is_terminal, width=60, highlight=False, color_system="standard")
    rows = table(text, ("name", ">value"), [[text, text]])
    for shown in (console.plain(text, "bold red"), rows, table(text, [text], [[Cell(text)]])):
        out.print(shown)
    out.print(text, markup=False)
    assert not commands(re.sub(r"\x1b\[[0-9;]*m", "", file.getvalue()))


@given(foreign)
def test_nothing_passes_a_repr_or_a_page(text):
    class Result(Shown):
        def _contents(self):
            return {text: text, "other": [text]}

    assert not commands(repr(Result()))
    page = table(text, [text], [[Cell(text)]]).html()
    assert "<script" not in page and "<b>" not in page and "</script" not in page


def test_errors_warnings_and_json_of_a_command_are_escaped(capsys, monkeypatch):
    monkeypatch.setattr("sys.argv", ["stickslip"])

    def fail() -> None:
        console.warn("log 'a\x1b[2J'")
        console.say(True, {"name": "\x9b31m\u202e\ud800"}, lambda _: None)
        raise StickslipError("column '\x1b]0;x\x07\u202e\r' is none of:\n  a, b")

    application = console.app("x", no_args_is_help=False)
    application.command()(fail)
    with pytest.raises(SystemExit):
        console.run(application)
    printed = capsys.readouterr()
    assert json.loads(printed.out) == {"name": "\x9b31m\u202e\ud800"} and not commands(printed.out + printed.err)
    assert "column '\\x1b]0;x\\x07\\u202e\\r' is none of:\n  a, b" in printed.err and "'a\\x1b[2J'" in printed.err
