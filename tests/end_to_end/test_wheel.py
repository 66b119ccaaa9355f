"""The wheel in an environment of its own, away from the checkout: what the manual says works there too.

The heavy dependencies are those of the environment that runs the tests; the suite itself is the one of the wheel.
"""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import manual
import pytest

ROOT = Path(__file__).parents[2]
PARTS = ("pyproject.toml", "README.md", "LICENSE", "fmu_models", "identification", "rig_io", "data", "docs")

# what a command of the manual needs that does not come along
ABSENT = {
    *("ball.fmu", "pump.fmu", "my_logs", "new_logs", "my_axis.toml", "DATA_EMPS.mat", "k168Nm_v42.mat"),
    *("my_system.py", "my_robot.urdf", "rig.toml", "iterates.csv", "damper.csv", "swing.csv"),
    "run.csv",
}
# minutes of work in parts that other commands here have shown to be in the wheel
LONG = (
    *("demo", "laws", "stress", "bench", "fit two", "emulate two", "export disc_rig --platform", "fit worn"),
    *("fit data/rigs/paper_rubber --covariance", "compare", "emulate worn"),
)


def commands() -> list[list[str]]:
    """Those of the manual, each once, without the word stickslip."""
    found = {shlex.join(line): line for page in manual.pages() for line in manual.commands(page)}
    known = [line for line in found.values() if not ABSENT & set(line)]
    return [line for line in known if not " ".join(line).startswith(LONG)]


def files(folder: Path) -> set[Path]:
    """Of a folder and those in it, hidden and compiled ones left out."""
    found = {path.relative_to(folder) for path in folder.rglob("*") if path.is_file()}
    return {path for path in found if not path.name.startswith(".") and "__pycache__" not in path.parts}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    source, made = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    for part in PARTS:
        if (ROOT / part).is_dir():
            shutil.copytree(ROOT / part, source / part, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copyfile(ROOT / part, source / part)
    # what stands for a manual that was built before
    (source / "docs" / "site").mkdir(exist_ok=True)
    (source / "docs" / "site" / "index.html").write_text("the manual", "utf-8")
    options = ("--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir", str(made))
    subprocess.run([sys.executable, "-m", "pip", "wheel", *options, str(source)], check=True)
    (found,) = made.glob("*.whl")
    return found


class Installed:
    """The wheel in a fresh environment; programs of it run in an empty folder."""

    def __init__(self, wheel: Path, place: Path, folder: Path) -> None:
        venv.create(place, with_pip=False)
        self.folder = folder
        self.site = Path(sysconfig.get_path("purelib", vars={"base": str(place), "platbase": str(place)}))
        self._scripts = place / ("Scripts" if os.name == "nt" else "bin")
        # a path in a .pth file is searched last, and its own .pth files, such as that of a checkout, are not read
        (self.site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
        options = ("--quiet", "--no-deps", "--no-index", "--disable-pip-version-check")
        python = str(self._scripts / Path(sys.executable).name)
        subprocess.run([sys.executable, "-m", "pip", "--python", python, "install", *options, str(wheel)], check=True)
        kept = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
        self._environment = kept | {"MPLBACKEND": "agg"}

    def __call__(self, program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
        line = [str(self._scripts / program), *arguments]
        return subprocess.run(line, cwd=self.folder, env=self._environment, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory) -> Installed:
    return Installed(wheel, tmp_path_factory.mktemp("environment"), tmp_path_factory.mktemp("empty"))


def test_the_wheel_holds_the_folder_data_and_every_file_of_the_packages(wheel):
    held = {Path(name) for name in zipfile.ZipFile(wheel).namelist()}
    for part, folder in {
        "data": "stickslip_data",
        "docs": "stickslip_docs",
        **{name: name for name in PARTS[3:6]},
    }.items():
        missing = {Path(folder, path) for path in files(ROOT / part)} - held
        assert not missing, f"{part}: not in the wheel: {sorted(map(str, missing))}"


@pytest.mark.nightly
def test_the_manual_that_a_wheel_brings_is_opened_and_one_without_shows_its_pages(installed):
    answer = installed("stickslip", "docs", "--no-open", "--json")
    assert answer.returncode == 0, answer.stderr
    said = json.loads(answer.stdout)
    site = installed.site / "stickslip_docs" / "site"
    assert (said["index"], said["built"], said["plain"]) == (str(site / "index.html"), False, False)
    shutil.rmtree(site)
    said = json.loads(installed("stickslip", "docs", "--no-open", "--json", "-o", "manual").stdout)
    assert said["plain"] and said["pages"] > 40 and (installed.folder / "manual" / "tutorials").is_dir()


@pytest.mark.nightly
def test_the_manual_s_commands_run_there(installed):
    code = "import fmu_models, identification, rig_io; print(fmu_models.__file__, fmu_models.__version__)"
    found = installed("python", "-c", code)
    assert found.stdout.startswith(str(installed.site)), found.stdout + found.stderr
    assert installed("stickslip", "--version").stdout == f"stickslip {found.stdout.split()[1]}\n"

    missing = installed("stickslip", "fit", "data/rigs/paper_rubber")
    assert missing.returncode == 2 and "stickslip data copy rigs/paper_rubber" in missing.stderr
    arm = ("two_link_arm.py", "two_link_arm_1.csv", "two_link_arm_2.csv")
    machines = [f"machines/{name}" for name in ("axis.csv", "slider.csv", *arm)]
    copied = ("rigs/paper_rubber", "systems_of_the_literature/simplest_walker.py", *machines)
    assert installed("stickslip", "data", "copy", *copied).returncode == 0
    listed = commands()
    assert {"fit", "report", "apply", "simulate", "export", "scene", "couple", "map"} <= {one[0] for one in listed}
    for line in listed:
        answer = installed("stickslip", *line)
        assert answer.returncode == 0, f"stickslip {shlex.join(line)}\n{answer.stdout}\n{answer.stderr}"
    written = {path.name for path in installed.folder.iterdir()}
    assert {"fit.json", "friction.png", "report.html", "rig.fmu", "portrait.png", "figure_9.png"} <= written


@pytest.mark.nightly
def test_the_manual_s_python_runs_there(installed):
    # a folder of its own, where commands have left no picture of the same name
    assert installed("stickslip", "data", "copy", "rigs/paper_rubber", "-o", "python/data").returncode == 0
    written = {page.name: code for page in manual.pages() if (code := manual.python(page))}
    assert {"README.md", "families.md", "models_and_fmus.md"} <= written.keys()
    # names of one page are not there on the next
    code = "import os; os.chdir('python')\n"
    code += "\n".join(f"exec(compile({code!r}, {name!r}, 'exec'), {{}})" for name, code in written.items())
    answer = installed("python", "-W", "error", "-c", code)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    assert "np.float64" not in answer.stdout and "array(" not in answer.stdout


@pytest.mark.nightly
def test_what_comes_along_is_listed_and_copied(installed):
    names = [item["name"] for item in json.loads(installed("stickslip", "data", "--json").stdout)["items"]]
    assert {
        "rigs/paper_rubber",
        "scenes/disc_rig_class_a",
        "recipes/emps",
        "systems/disc_rig_motors",
        "README.md",
    } <= set(names)
    assert installed("stickslip", "data", "copy", "-o", "all", *names).returncode == 0
    assert files(installed.folder / "all") == files(ROOT / "data")
    again = installed("stickslip", "data", "copy", "-o", "all", names[0])
    assert again.returncode == 2 and "--overwrite" in again.stderr
    wrong = installed("stickslip", "data", "copy", "scenes/disc_rig_clas_a")
    assert wrong.returncode == 2 and "Did you mean 'scenes/disc_rig_class_a'" in wrong.stderr
