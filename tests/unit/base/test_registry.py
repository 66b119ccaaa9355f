"""Extension points: members of a folder, of installed packages, and those that a user names."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path, PurePosixPath

import pytest

from fmu_models.base.errors import StickslipError
from fmu_models.base.registry import Registry

PATHS = Registry[PurePosixPath](
    kind="path",
    package="fmu_models.oscillators",
    attribute="HERE",
    group="stickslip.tests",
    types=("pathlib.PurePosixPath",),
)
ANY = Registry[object](kind="number", package="fmu_models.oscillators", attribute="NUMBER", group="stickslip.tests")
SOURCE = "from pathlib import PurePosixPath\n"


def write(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def test_listing_imports_no_member():
    code = (
        "import sys; from fmu_models.oscillators import MODELS; from fmu_models.maps import MAPS;"
        "assert 'disc_rig' in MODELS.names() and MAPS.members()[0] == 'fermi_simplified';"
        "assert 'sympy' not in sys.modules and 'numpy' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_file_or_one_of_its_names(tmp_path):
    write(tmp_path / "mine.py", f"{SOURCE}HERE = PurePosixPath('a')\nTHERE = PurePosixPath('b')\n")
    assert PATHS.load("mine.py", tmp_path) == PATHS.load(tmp_path / "mine.py") == PurePosixPath("a")
    assert PATHS.load("mine.py:THERE", tmp_path) == PATHS.load("mine:THERE", tmp_path) == PurePosixPath("b")


def test_relative_to_the_working_folder(tmp_path, monkeypatch):
    write(tmp_path / "mine.py", "NUMBER = 1")
    monkeypatch.chdir(tmp_path)
    assert ANY.load("mine.py") == ANY.load("mine:NUMBER") == 1


def test_a_file_is_as_it_is_now_and_so_are_the_modules_beside_it(tmp_path):
    """In another folder a module of the same name is another one; nothing is left behind."""
    for value in (1, 2):  # within one second: too fast for Python's bytecode
        write(tmp_path / "beside.py", f"VALUE = {value}")
        mine = write(tmp_path / "mine.py", f"import beside\nNUMBER = 10 * beside.VALUE + {value}")
        assert ANY.load(mine) == ANY.load("mine:NUMBER", tmp_path) == 11 * value
    write(tmp_path / "other" / "beside.py", "VALUE = 7")
    assert ANY.load(write(tmp_path / "other" / "mine.py", "import beside\nNUMBER = beside.VALUE")) == 7
    assert "beside" not in sys.modules and str(tmp_path) not in sys.path
    assert not list(tmp_path.rglob("__pycache__"))


def test_what_a_file_prints_is_no_result(tmp_path, capsys):
    ANY.load(write(tmp_path / "mine.py", "print('hello')\nNUMBER = 1"))
    assert capsys.readouterr() == ("", "hello\n")


def test_dataclasses_with_names_for_types_can_be_declared(tmp_path):
    text = "from __future__ import annotations\nfrom dataclasses import dataclass\n"
    text += "@dataclass\nclass One:\n    x: int\nNUMBER = One(3)\n"
    assert vars(ANY.load(write(tmp_path / "mine.py", text))) == {"x": 3}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = 1\ny = 1 / 0\n", "mine.py, line 2: ZeroDivisionError: division by zero"),
        ("x = 1\n\ndef f(:\n", "mine.py, line 3: SyntaxError: invalid syntax"),
        ("import beside\n", "beside.py, line 2: ValueError: no"),
        ("import json\n\njson.loads('{')\n", "mine.py, line 3: JSONDecodeError: Expecting"),
        ("import not_installed\n", "mine.py, line 1: ModuleNotFoundError: No module named 'not_installed'"),
        ("raise SystemExit\n", "mine.py, line 1: SystemExit."),
        (
            "from fmu_models.base.errors import StickslipError\nraise StickslipError('The slip is missing.')\n",
            "mine.py, line 2: The slip is missing.",
        ),
        (
            "from fmu_models.oscillators import load\nload('dics_rig')\n",
            "mine.py, line 2: No model is called 'dics_rig'. Did you mean 'disc_rig'?",
        ),
    ],
)
def test_an_error_shows_the_line_of_the_user(tmp_path, monkeypatch, text, message):
    write(tmp_path / "beside.py", "\nraise ValueError('no')")
    write(tmp_path / "mine.py", text)
    monkeypatch.chdir(tmp_path)
    for reference in ("mine.py", "mine:NUMBER"):
        with pytest.raises(StickslipError, match=f"^{re.escape(message)}"):
            ANY.load(reference)


@pytest.mark.parametrize(
    ("reference", "message"),
    [
        ("mien.py", "The path 'mien.py' does not exist. Did you mean 'mine.py'?"),
        ("mine", "No path is called 'mine'. For the file beside, write mine.py."),
        ("mine.py", "'mine.py' defines no HERE. It has THERE: write mine.py:THERE."),
        ("mine.py:THREE", "'mine.py' defines no THREE. It has THERE: write mine.py:THERE."),
        ("empty.py", "'empty.py' defines no HERE. End it with HERE = ..., the path."),
        ("mine.py:NUMBER", "NUMBER of 'mine.py' is no path: it must be a PurePosixPath, found one of class int."),
        (
            "mine.py:PurePosixPath",
            "PurePosixPath of 'mine.py' is no path: it must be a PurePosixPath, found the class PurePosixPath.",
        ),
        ("absent.module:HERE", "The path is to come from a module 'absent.module', which is neither in '"),
    ],
)
def test_an_error_says_what_was_found(tmp_path, reference, message):
    write(tmp_path / "mine.py", f"{SOURCE}THERE = PurePosixPath('b')\nNUMBER = 1")
    write(tmp_path / "empty.py", "")
    with pytest.raises(StickslipError, match=f"^{re.escape(message)}"):
        PATHS.load(reference, tmp_path)


def install(folder: Path, package: str, version: str, points: str) -> None:
    """A package that offers members, as pip leaves it."""
    information = folder / f"{package}-{version}.dist-info"
    write(information / "METADATA", f"Metadata-Version: 2.1\nName: {package}\nVersion: {version}\n")
    write(information / "entry_points.txt", f"[stickslip.tests]\n{points}\n")


def test_installed_packages_offer_members(tmp_path, monkeypatch):
    write(tmp_path / "theirs" / "numbers.py", "NUMBER = 5\nraise_here = True")
    write(tmp_path / "theirs" / "broken.py", "\n1 / 0")
    install(tmp_path, "theirs", "1.2", "five = theirs.numbers:NUMBER\nfive_too = theirs.numbers\nbad = theirs.broken")
    monkeypatch.syspath_prepend(tmp_path)
    assert ANY.names() == ["bad", "five", "five_too"] and ANY.members() == []
    assert ANY.load("five") == ANY.load("five_too") == ANY.load("theirs.numbers:NUMBER") == 5
    assert ANY.origin("five") == "theirs 1.2"
    with pytest.raises(StickslipError, match=r"broken\.py, line 2: ZeroDivisionError"):
        ANY.load("bad")
    with pytest.raises(StickslipError, match=r"No number is called 'fiev'\. Did you mean 'five'\?"):
        ANY.load("fiev")
    install(tmp_path, "others", "1", "five = others:FIVE")
    with pytest.raises(StickslipError, match=r"Two packages offer a number 'five': others:FIVE and theirs\.numbers:NU"):
        ANY.load("five")


def test_origin_of_what_is_named():
    registry = Registry(kind="map", package="fmu_models.maps", attribute="MAP", group="stickslip.tests")
    assert registry.origin("henon") == "stickslip"
    assert registry.origin("a/mine.py") == "a/mine.py"
    with pytest.raises(StickslipError, match="No map is called 'henn'"):
        registry.origin("henn")
