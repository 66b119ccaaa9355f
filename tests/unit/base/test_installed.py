"""What a short command asks about its installation, without the modules that take long."""

import os
from importlib import metadata
from pathlib import Path

import pytest

from fmu_models.base.files import stamps
from fmu_models.base.version import version_of


@pytest.mark.parametrize("package", ["fmpy", "sympy", "ziglang", "stickslip", "typing_extensions"])
def test_versions_are_those_of_the_metadata(package: str) -> None:
    assert version_of(package) == metadata.version(package)


def test_what_is_not_installed_has_no_version() -> None:
    assert version_of("no-such-package") == ""


def test_a_stamp_changes_with_a_file_and_with_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "below").mkdir()
    for name in ("a.py", "below/b.c"):
        (tmp_path / name).write_text("1")
        os.utime(tmp_path / name, (1, 1))
    before = set(stamps(tmp_path))
    assert {line.partition("\n")[0] for line in before} == {f"{tmp_path / 'a.py'}", f"{tmp_path / 'below/b.c'}"}
    (tmp_path / "a.pyc").write_text("2")
    assert set(stamps(tmp_path)) == before
    (tmp_path / "below/b.c").write_text("2")
    assert len(set(stamps(tmp_path)) - before) == 1
