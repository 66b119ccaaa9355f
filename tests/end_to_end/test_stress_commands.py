"""`stickslip stress` as a user meets it: verdicts, random cases, what bad input answers, and an interrupt."""

from __future__ import annotations

from pathlib import Path

import pytest


def test_stress_judges_models_of_every_kind_of_contact(stickslip):
    quick = stickslip("stress", "--quick", "--json", "--figure", "heat.png")
    assert quick.code == 0
    content = quick.json
    assert content["totals"]["failed"] == 0
    assert content["finished"] == content["asked"] >= 20
    assert {"friction", "impact", "stop", "switch"} <= {row["about"].split()[0] for row in content["cells"]}
    assert Path("heat.png").stat().st_size > 1000
    shown = stickslip("stress", "impact_pair", "--case", "D=*", "--every", "--processes", 1)
    assert shown.code == 0
    assert "D=0: refused: the walls overlap: their distance D must be positive" in shown.out
    assert "D=6000: accurate" in shown.out
    assert "4 of 4 cells: 2 accurate, 0 degraded, 2 refused, 0 failed" in shown.out


@pytest.mark.nightly
def test_stress_draws_random_cases(stickslip):
    arguments = ("stress", "impact_pair", "woodpecker", "--random", 9, "--seed", 1)
    content = stickslip(*arguments, "--json").json
    assert content["asked"] == content["finished"] == 9
    assert {name: sum(counts.values()) for name, counts in content["models"].items()} == {
        "impact_pair": 5,
        "woodpecker": 4,
    }
    assert content["totals"]["failed"] == 0
    assert all(row["again"].startswith(f"stickslip simulate {row['model']} ") for row in content["cells"])
    assert [row["again"] for row in stickslip(*arguments, "--json").json["cells"]] == [
        row["again"] for row in content["cells"]
    ]
    shown = stickslip(*arguments)
    assert shown.code == 0
    # each that is refused is listed with its reason, and the command that repeats it in one line
    (refused,) = (row for row in content["cells"] if row["verdict"] == "refused")
    assert f"  {refused['case']}: refused: the wall of the rigid contact" in shown.out
    assert f"    again: {refused['again']}\n" in shown.out


@pytest.mark.parametrize(
    ("arguments", "lesson"),
    [
        (("disc_rgi",), "Did you mean 'disc_rig'?"),
        (("disc_rgi", "--random", "5"), "Did you mean 'disc_rig'?"),
        (("impact_pair", "--seed", "5"), "Say how many: --random 500"),
        (("impact_pair", "--random", "5", "--quick"), "leave them out with --random"),
        (("impact_pair", "--random", "0"), "--random"),
        (("impact_pair", "--case", "d=0"), "No case matches 'd=0'"),
        (("impact_pair", "--until", "-1"), "positive time"),
        (("impact_pair", "--figure", "heat.txt"), "heat.txt"),
    ],
)
def test_stress_answers_bad_input(stickslip, arguments, lesson):
    answer = stickslip("stress", *arguments)
    assert answer.code == 2
    assert lesson in answer.err.replace("\n", " ")


def test_an_interrupted_stress_keeps_what_is_finished(stickslip, monkeypatch):
    from fmu_models.validation.stress import workers

    whole = workers.judged

    def two_then_an_interrupt(cases, progress, pool):
        cells = whole(cases, progress, pool)
        yield next(cells)
        yield next(cells)
        cells.close()  # type: ignore[attr-defined]  # a generator
        raise KeyboardInterrupt

    monkeypatch.setattr(workers, "judged", two_then_an_interrupt)
    answer = stickslip("stress", "planar_hopf", "--json", "--processes", 1)
    assert answer.code == 130
    assert (answer.json["finished"], answer.json["totals"]["failed"]) == (2, 0)
    assert answer.json["asked"] > 10
    assert "interrupted" in answer.err
