"""Mutants of small files by hand, and a run over a small tree: what is killed, what survives, what is noted."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
sys.path.append(str(TESTS))

from mutation.alterations import is_compiled, mutants  # noqa: E402

PYTHON = '''"""A text with 1 + 1 and not a < b."""
LIMIT = 2
def area(a: int | None, b: float = -1.0) -> float:
    if not a or b in (0, 3):
        raise ValueError("a" + str(1 + 1))
    return (a) * (b) ** 2 - f(f"{a + 1}")[0]
'''
C = """/* a * b */
#define TWICE(x) (2 * (x))
static double area(const double *a, int n)
{
    const int first = 0; // n > 1
    double sum = -a[0];
    for (int i = 1; i < n && a[i] != 0.0; i++) {
        sum += fabs(a[i]) * n;
    }
    return !n ? 0.0 : sum / n;
}
"""


def altered(file: str, text: str) -> list[tuple[int, str]]:
    return [(mutant.line, mutant.altered.strip()) for mutant in mutants(file, text)]


def test_mutants_of_python() -> None:
    assert altered("a.py", PYTHON) == [
        (3, "def area(a: int | None, b: float = 1.0) -> float:"),
        (4, "if a or b in (0, 3):"),
        (4, "if not a and b in (0, 3):"),
        (4, "if not a or b not in (0, 3):"),
        (4, "if not a or b in (1, 3):"),
        (6, 'return (a) / (b) ** 2 - f(f"{a + 1}")[0]'),
        (6, 'return (a) * (b) * 2 - f(f"{a + 1}")[0]'),
        (6, 'return (a) * (b) ** 3 - f(f"{a + 1}")[0]'),
        (6, 'return (a) * (b) ** 2 + f(f"{a + 1}")[0]'),
        (6, 'return (a) * (b) ** 2 - f(f"{a + 1}")[1]'),
    ]
    assert all(is_compiled(mutant, PYTHON) for mutant in mutants("a.py", PYTHON))


def test_what_nobody_sees_is_left_as_it_is() -> None:
    text = (
        "@dataclass(frozen=True, order=True)\nclass A:\n    progress((1 + n) / 3)\n    f = Figure(figsize=(2, n + 1))\n"
    )
    assert altered("a.py", text) == [(1, "@dataclass(frozen=True, order=False)")]


def test_a_mutant_that_does_not_compile_is_told() -> None:
    text = "while True:\n    try:\n        break\n    finally:\n        pass\n"
    (condition, leave) = mutants("a.py", text)
    assert (condition.altered, leave.altered.strip()) == ("while False:", "continue")
    assert is_compiled(leave, text) and not is_compiled(leave, text.replace("while True", "if True"))


def test_mutants_of_c() -> None:
    assert altered("a.c", C) == [
        (6, "double sum = a[0];"),
        (6, "double sum = -a[1];"),
        (7, "for (int i = 2; i < n && a[i] != 0.0; i++) {"),
        (7, "for (int i = 1; i >= n && a[i] != 0.0; i++) {"),
        (7, "for (int i = 1; i < n || a[i] != 0.0; i++) {"),
        (7, "for (int i = 1; i < n && a[i] == 0.0; i++) {"),
        (8, "sum -= fabs(a[i]) * n;"),
        (8, "sum += (a[i]) * n;"),
        (8, "sum += fabs(a[i]) / n;"),
        (10, "return n ? 0.0 : sum / n;"),
        (10, "return !n ? 0.0 : sum * n;"),
    ]


SOURCE = """def larger(a, b):
    return a if a > b else b


def count(values):
    total = 0
    for _ in values:
        total += 1
    return total


def only_run(a):
    return a + 2


def noted(a):
    return a * 1.5
"""
TEST = """import subprocess
import sys

from rig_io.sensors.small import count, larger, only_run


def test_larger():
    assert (larger(1, 2), larger(3, 2)) == (2, 3)


def test_another_process():
    code = "from rig_io.sensors.small import count; assert count('abc') == 3"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_only_run():
    only_run(1)


def test_that_fails_anyhow():
    assert larger(1, 2) == 1
"""
NOTE = """[[equivalent]]
file = "rig_io/sensors/small.py"
stands = "return a * 1.5"
mutant = "return a / 1.5"
reason = "nobody calls it"
"""


@pytest.fixture(scope="module")
def small_tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A repository with the tool, one module, and files of tests of which the third covers most."""
    tree = tmp_path_factory.mktemp("small") / "checkout"
    shutil.copytree(TESTS / "mutation", tree / "tests/mutation", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copyfile(TESTS / "mutants.py", tree / "tests/mutants.py")
    files = {"rig_io/__init__.py": "", "rig_io/sensors/__init__.py": "", "rig_io/sensors/small.py": SOURCE}
    files |= {"tests/unit/test_other.py": "from rig_io.sensors.small import larger, count\n\ndef test(): pass\n"}
    files |= {"tests/unit/test_small_words.py": "import rig_io.sensors.small\n\ndef test(): pass\n"}
    files |= {"tests/unit/test_users.py": TEST, "tests/mutation/equivalent.toml": NOTE}
    for name, text in files.items():
        (tree / name).parent.mkdir(parents=True, exist_ok=True)
        (tree / name).write_text(text, "utf-8")
    subprocess.run(["git", "init", "-q", str(tree)], check=True)
    return tree


def run(tree: Path, *options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "tests/mutants.py", "--folder", str(tree.parent / "state"), "--patience", "30", *options]
    return subprocess.run(command, cwd=tree, capture_output=True, text=True, check=False)


def contents(tree: Path) -> dict[Path, bytes]:
    """Of all files but those that Python compiled on its way."""
    return {path: path.read_bytes() for path in tree.rglob("*") if path.is_file() and path.suffix != ".pyc"}


@pytest.mark.nightly
def test_a_run_over_a_small_tree(small_tree: Path) -> None:
    before = contents(small_tree)
    done = run(small_tree, "--count", "50", "--json")
    assert done.returncode == 1, done.stderr
    result = json.loads(done.stdout)
    # one test runs it and asks for nothing; another fails without any mutant, and so kills none
    (survivor,) = result["survivors"]
    assert survivor["line"] == 13 and "tests/unit/test_users.py" in survivor["tried"]
    counts = result["rooms"]["rig_io/sensors"]
    assert counts == {"killed": 3, "survived": 1, "equivalent": 1}
    # what was judged is not judged again
    assert json.loads(run(small_tree, "--count", "50", "--minutes", "0", "--json").stdout) == result
    assert before == contents(small_tree)
