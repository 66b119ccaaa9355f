"""Tables for people: whatever the width, digits stay together, heads are whole, and what is missing is named."""

from __future__ import annotations

import io
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from fmu_models.base.table import Cell, PrintedColumn, interval, known_to, measured, number, sd, table, verdict

WIDTHS = (60, 80, 200)


def printed(made, width: int) -> str:
    console = Console(width=width, file=io.StringIO(), record=True)
    console.print(made)
    return console.export_text()


def parameters():
    columns = (
        *("parameter", "value", "sd, noise", "sd, rig constants", PrintedColumn("95 %, noise", spare=1)),
        *("unit", PrintedColumn("meaning", spare=2)),
    )
    words = "limit of the friction coefficient as the slip speed goes to zero"
    rows = [
        [name, known_to(value, noise), sd(noise), sd(0.0036), interval(0.6493, 0.6502, noise), "s/m", words]
        for name, value, noise in (("mu_s", 0.64979, 0.00022), ("a_rather_long_name", 0.3499, 0.00012))
    ]
    return table("Conti law of disc0 (shooting, 63 slip segments of 3 logs)", columns, rows)


def strobes(count: int = 30):
    rows = [
        [name, *(number(factor * i, ".10g") for i in range(count))] for name, factor in (("x", 1.23456789), ("v", -3))
    ]
    return table("strobe", ("result", *(f"r = {i / 7:.4g}" for i in range(count))), rows)


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("made", [parameters(), strobes(), strobes().turned()], ids=["fit", "strobes", "turned"])
def test_digits_and_heads_stay_whole_at_any_width(made, width):
    text = printed(made, width)
    assert all(len(line) <= width for line in text.splitlines())
    words = text.split()
    left_out = "".join(re.findall(r"Left out for want of width: (.*) \(--json", " ".join(words)))
    for place, column in enumerate(made.columns):
        if place and column.head in left_out.split("; "):
            assert column.spare
            continue
        for part in column.words.split():
            assert part in words, part
        for row in made.rows:
            if row[place].kind == "number":
                for part in row[place].words.split():
                    assert part in words, part


def test_columns_go_by_what_can_be_spared_and_are_named():
    assert "Left out" not in printed(parameters(), 200)
    assert "Left out for want of width: meaning (--json has all)." in printed(parameters(), 80)
    narrow = " ".join(printed(parameters(), 60).split())
    assert "Left out for want of width: 95 %, noise; meaning (--json has all)." in narrow


def test_what_cannot_be_spared_goes_on_below_with_the_names_of_the_rows():
    text = printed(strobes(), 80)
    blocks = [line for line in text.splitlines() if line.startswith("x ")]
    assert len(blocks) > 3
    assert sum(len(line.split()) - 1 for line in blocks) == 30


def test_a_listing_shows_its_title_its_heads_and_its_rows():
    text = printed(table("Two of a kind", ("model", ">mass (kg)"), [["slider", "1.5"]]), 60)
    assert text.index("Two of a kind") < text.index("mass (kg)") < text.index("slider") < text.index("1.5")
    with pytest.raises(ValueError, match="argument 2"):
        table("Two of a kind", ("model", ">mass (kg)"), [["belt"]])


def test_rows_become_columns():
    turned = strobes(3).turned()
    assert [column.words for column in turned.columns] == ["result", "x", "v"]
    assert [[cell.words for cell in row] for row in turned.rows][1] == ["r = 0.1429", "1.23456789", "-3"]


@given(st.integers(40, 120), st.lists(st.tuples(*[st.floats(allow_nan=False)] * 6), min_size=1, max_size=5))
def test_no_number_breaks(width, values):
    made = table(
        "t", [f"head {i}" for i in range(7)], [["row", *(number(one, ".10g") for one in row)] for row in values]
    )
    text = printed(made, width)
    for row in values:
        for one in row:
            assert f"{one + 0:.10g}" in text.split()  # no zero has a sign


def test_verdicts_and_what_others_wrote():
    made = table("<t>", ("log", "verdict"), [["a <b>\x1b[31m[bold]", verdict(False)], ["c", verdict(True)]])
    page, text = made.html(), printed(made, 80)
    assert '<td class="fail">FAIL</td>' in page and "<td>pass</td>" in page and "&lt;t&gt;" in page
    assert "\x1b" not in text and "[31m[bold]" in text and "a &lt;b&gt;" in page


def test_both_renderers_show_the_same():
    made = parameters()
    page, text = made.html(), printed(made, 300)
    for row in made.rows:
        for cell in row:
            assert cell.words in page and cell.words in text
    for column in made.columns:
        assert column.words in page and column.words in text


def test_numbers_of_every_kind():
    assert measured(0.65, 0.015) == Cell("0.650 ± 0.015", "number")
    assert interval(0.6493, None, 0.015).words == "0.649 .. open"
    assert number(None).words == "" and sd(None).words == ""


def test_some_columns_stand_in_the_order_that_is_asked_for():
    whole = table("what", ("name", "a", PrintedColumn("b", "m", spare=1)), [["x", "1", number(2.0)], ["y", "3", "4"]])
    part = whole.taking("b", "a")
    assert [column.words for column in part.columns] == ["name", "b (m)", "a"]
    assert [[cell.words for cell in row] for row in part.rows] == [["x", "2", "1"], ["y", "4", "3"]]
    assert 'tabindex="0" role="group" aria-label="what"' in part.html()
