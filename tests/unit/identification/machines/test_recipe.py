"""Recipes: what is wrong in one is said with its line and what to do; what does not fit a log likewise."""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from asked import Asked
from machine_log import LINEAR, MEASURED, motion, recipe_of, table_of
from made import formats
from recipe_fit import inverse_dynamics

from fmu_models.base.errors import StickslipError
from fmu_models.base.toml_document import Document
from identification.inference.problem import Solution, solve
from identification.machines.axis import read_model
from identification.machines.by_recipe import motions_of, recipe_machine
from identification.machines.problem import machine_problem
from identification.machines.regressor import base_parameters, regressor_of
from identification.machines.rows import rows_of
from identification.measurement import recipe as recipe_room
from identification.measurement.recipe import Recipe, read_recipe, recipes
from identification.measurement.signals import prepare
from identification.slips.statistics import read_slips
from rig_io.readers.csv_log import write

GOOD = MEASURED + LINEAR


def fitted(recipe: Recipe) -> Solution:
    prepared = prepare(recipe, table_of())
    regressor = regressor_of(recipe_machine(recipe).mechanism)
    return solve(machine_problem(rows_of(regressor, base_parameters(regressor), motions_of(recipe, prepared))))


def read(path: str | Path) -> Recipe:
    """A recipe with all its tables, each read by the room that needs it."""
    recipe = read_recipe(path)
    if "terms" in recipe.document.data:
        read_model(recipe)
    if "slips" in recipe.document.data:
        read_slips(recipe)
    return recipe


@pytest.mark.parametrize("path", recipes(), ids=lambda path: path.stem)
def test_every_recipe_that_comes_along_is_read(path):
    recipe = read(path.stem)
    assert recipe.title and recipe.source


# every table of a recipe
WHOLE = MEASURED.replace('"x"', '"x"\nfilter = { cutoff = 9 }').replace(
    'column = "a"\nunit = "m/s2"', 'derivative_of = "velocity"\nsavitzky_golay = { window = 1 }'
) + LINEAR.replace('"coulomb"', '{ term = "coulomb-tanh", speed = 1 }')
WHOLE += "[friction]\nnormal_force = 1\n[sampling]\nrate = 1\n"
WHOLE += "[slips]\nmass = 1\nstiffness = 1\nspeed = 1\ndamping = 1\nsmoothing = 1\nshare = 0.1\n"


def heading(place: tuple[str | int, ...]) -> str:
    """Of the page of the reference, above the keys of the table at a place."""
    match place:
        case ():
            return "Keys of a recipe"
        case ("signals", _):
            return "[signals.NAME]"
        case ("signals", _, inner):
            return str(inner)
    return f"[{place[0]}]"


def test_the_manual_lists_the_keys_that_are_asked_for_and_no_others_are_accepted(tmp_path, monkeypatch):
    asked: dict[str, set[str]] = defaultdict(set)
    accepted, check = {}, Document.check_keys

    def noting(table: dict[str, Any], *place: str) -> Asked:
        inner = {name: noting(one, *place, name) if isinstance(one, dict) else one for name, one in table.items()}
        named = place in {("signals",), ("terms",)}  # names, not keys
        return Asked(inner, set() if named else asked[heading(place)])

    def noted(path: Path) -> Document:
        document = Document(path, path.read_text("utf-8"))
        document.data = noting(document.data)
        return document

    def checked(document: Document, known: Any, *place: str | int) -> None:
        accepted[heading(place)] = set(known)
        check(document, known, *place)

    monkeypatch.setattr(recipe_room, "read_document", noted)
    monkeypatch.setattr(Document, "check_keys", checked)
    read(recipe_of(tmp_path, WHOLE))
    page = dict(formats.pages())["reference/recipe.md"]
    parts = (part.split("\n", 1) for part in re.split(r"^#+ ", page, flags=re.MULTILINE)[1:])
    tables = {title: re.search(r"^\| key .*\n.*\n((?:\| .*\n)+)", body, re.MULTILINE) for title, body in parts}
    listed = {
        title: set(re.findall(r"^\| `(\w+)`", table[1], re.MULTILINE)) for title, table in tables.items() if table
    }
    assert listed == accepted == asked


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ('title = "a slide"', 'titel = "a slide"', 1, "Did you mean 'title'"),
        ('column = "x"', 'colum = "x"', 8, "Did you mean 'column'"),
        ('column = "x"', 'column = "x"\nderivative_of = "velocity"', 7, "either 'column' .* or 'derivative_of'"),
        ('unit = "m"', "", 7, "'unit' is missing"),
        (
            'column = "v"\nunit = "m/s"',
            'derivative_of = "positon"',
            12,
            "no signal 'positon'.* Did you mean 'position'",
        ),
        ('column = "v"\nunit = "m/s"', 'derivative_of = "acceleration"\n', 1, ""),
        ('column = "v"', 'column = "v"\nderivative = 2', 13, "'derivative' says nothing of a column"),
        (
            'column = "v"\nunit = "m/s"',
            'derivative_of = "position"\ngain = 2',
            13,
            "'gain' says nothing of a derivative",
        ),
        ('column = "F"', 'column = "F"\ngain = true', 21, "'gain' must be a number, or the name"),
        ('column = "F"', 'column = "F"\nfilter = { order = 4 }', 21, 'needs "cutoff", such as "100 Hz"'),
        ('column = "F"', 'column = "F"\nfilter = { cutoff = "1.5 Nyquist" }', 21, "below the Nyquist frequency"),
        ('column = "F"', 'column = "F"\nfilter = { cutoff = "3 m" }', 21, "cannot be converted to Hz"),
        ('column = "F"', 'column = "F"\nfilter = { cutof = 3 }', 21, "Did you mean 'cutoff'"),
        ('M = "inertia"', 'M = "inertai"', 24, "'inertai' is not a term.* Did you mean 'inertia'"),
        ('M = "inertia"', "M = 5", 24, "must be the name of a term"),
        ('Fc = "coulomb"', '"\u00b5" = "coulomb"', 26, "cannot name a parameter of a machine: use letters from a to z"),
        ('Fc = "coulomb"', 'Fc = "coulomb-tanh"', 26, "needs 'speed', the speed over which it turns"),
        ('Fc = "coulomb"', 'Fc = { term = "coulomb", speed = 1 }', 26, "has no 'speed'"),
        ("[terms]", "[sampling]\ndecimate = 0\n[terms]", 24, "whole number from 1 on"),
        ("[terms]", "[sampling]\nrate = 0\n[terms]", 24, "'rate' must be above 0 Hz"),
        ("[terms]", '[friction]\ncompare = ["Conty"]\n[terms]', 24, "no friction law 'Conty'.* Did you mean 'Conti'"),
        ("[terms]", '[friction]\ncompare = ["Conti"]\n[terms]', 24, "'compare' needs two laws or more"),
        ("[terms]", '[friction]\nnormal_force = "-1 N"\n[terms]', 24, "'normal_force' must be above 0 N"),
        ("[terms]", "[slips]\nshare = 1.0\n[terms]", 24, "'share' must lie from 0 to below 1"),
        ("[terms]", '[slips]\nmass = "3 N"\n[terms]', 24, "cannot be converted to kg"),
    ],
)
def test_a_fault_is_named_with_its_line(tmp_path, old, new, line, message):
    assert GOOD.count(old) >= 1
    path = recipe_of(tmp_path, GOOD.replace(old, new, 1))
    if not message:
        path = recipe_of(
            tmp_path, GOOD.replace(old, new, 1).replace('column = "a"\nunit = "m/s2"', 'derivative_of = "velocity"')
        )
        message, line = "derivatives of one another. One of them must be a column", 11
    with pytest.raises(StickslipError, match=message) as error:
        read(path)
    assert f"{path}, line {line}:" in str(error.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('title = "x"\n[signals.position]\ncolumn = "x"\nunit = "m"\n', "no signal 'time'. Add"),
        (MEASURED, r"neither \[terms\] .* nor \[slips\]"),
    ],
)
def test_what_is_missing_is_said(tmp_path, text, message):
    with pytest.raises(StickslipError, match=message):
        read(recipe_of(tmp_path, text))


def test_what_is_nested_without_end_is_no_recipe(tmp_path):
    path = tmp_path / "deep.toml"
    path.write_text("title = " + "[" * 5000, "utf-8")
    with pytest.raises(StickslipError, match="is not TOML"):
        read_recipe(path)


def test_a_name_that_no_file_can_have_names_none():
    with pytest.raises(StickslipError, match="There is no recipe"):
        read_recipe("n" * 5000)


def test_an_unknown_name_gets_a_hint(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(StickslipError, match=r"no recipe 'emsp'.* Did you mean 'emps'"):
        read_recipe("emsp")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('column = "x"', 'column = "X"', "no column 'X', which recipe recipe.toml reads as 'position'"),
        ('unit = "m"', 'unit = "kg"', r"signal 'position' is in 'kg', which cannot be converted to m"),
        ('unit = "m"', 'unit = "metre per"', "unknown unit 'metre per'"),
        ('unit = "N"', 'unit = "V"', "signal 'effort' is in 'V', which cannot be converted to N"),
        ('unit = "N"', 'unit = "N m"', "slides and of one that turns .*effort in N m"),
        (
            'column = "a"\nunit = "m/s2"',
            'derivative_of = "position"',
            "'acceleration' comes out in 'm/s', expected m/s2",
        ),
        ('[signals.acceleration]\ncolumn = "a"\nunit = "m/s2"', "", ""),
        ("[terms]", "[sampling]\nrate = 500\n[terms]", "sampled at 1000 Hz, but recipe recipe.toml says 500 Hz"),
        ("[terms]", "[sampling]\ndrop = 9990\n[terms]", "too short for this recipe"),
        (
            'column = "F"',
            'column = "F"\nfilter = { cutoff = 600 }',
            "cutoff of 600 Hz is not below half the sampling rate",
        ),
        ("[terms]", '[sampling]\nleast_speed = "3 deg/s"\n[terms]', "'least_speed' .* rad/s, but the body slides"),
        ("[terms]", '[terms]\nk = "stiffness"\nx0 = "gravity"', "one of a body that turns"),
    ],
)
def test_what_does_not_fit_the_log_is_said(tmp_path, old, new, message):
    assert GOOD.count(old) >= 1
    recipe = read_recipe(recipe_of(tmp_path, GOOD.replace(old, new, 1)))
    if not message:  # left out, the acceleration is the derivative of the velocity
        assert fitted(recipe).values[0] == pytest.approx(5.0, rel=1e-2)
        return
    with pytest.raises(StickslipError, match=message):
        fitted(recipe)


def test_a_term_without_its_signal_is_named(tmp_path):
    text = MEASURED.split("[signals.position]")[0] + "[signals.velocity]" + MEASURED.split("[signals.velocity]")[1]
    recipe = read_recipe(recipe_of(tmp_path, text + '[terms]\nk = "stiffness"\n'))
    with pytest.raises(StickslipError, match=r"term 'k' \(stiffness\) needs the signal 'position'"):
        fitted(recipe)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (
            lambda columns: columns["F"].__setitem__(70, np.nan),
            "column 'F' holds no number in 1 samples, the first at line 72",
        ),
        (
            lambda columns: columns["time"].__setitem__(slice(50, None), columns["time"][50:] - 0.02),
            "time does not rise",
        ),
        (lambda columns: columns["time"].__setitem__(50, columns["time"][49]), "time does not rise at line 52"),
    ],
)
def test_bad_samples_are_named(tmp_path, spoil, message):
    columns = {**motion(), "F": np.zeros(10_000)}
    spoil(columns)
    write(tmp_path / "log.csv", columns)
    with pytest.raises(StickslipError, match=message):
        inverse_dynamics(read_recipe(recipe_of(tmp_path, GOOD)), tmp_path / "log.csv")


def test_a_unit_in_the_log_counts_and_must_be_of_the_same_kind(tmp_path):
    columns = motion()
    effort = 5 * columns["a"] + 12 * columns["v"] + 3 * np.sign(columns["v"])
    recipe = read_recipe(recipe_of(tmp_path, GOOD))
    write(tmp_path / "good.csv", {**{name: columns[name] for name in ("time", "x", "v", "a")}, "F [kN]": effort / 1e3})
    text = (tmp_path / "good.csv").read_text().replace("F [kN]", "F [mm]", 1)
    (tmp_path / "bad.csv").write_text(text)
    good = (tmp_path / "good.csv").read_text().replace("time,x,v,a", "time [s],x [m],v [m/s],a [m/s2]", 1)
    (tmp_path / "good.csv").write_text(good)
    assert inverse_dynamics(recipe, tmp_path / "good.csv")["M"].value == pytest.approx(5.0)
    with pytest.raises(
        StickslipError, match=r"column 'F', for signal 'effort' of recipe.toml, is in 'mm', which cannot"
    ):
        inverse_dynamics(recipe, tmp_path / "bad.csv")
