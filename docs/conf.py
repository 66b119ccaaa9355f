"""Sphinx's settings for the manual: `stickslip docs --build` builds it, or `sphinx-build -W docs build/docs`.

Pages are Markdown. One that begins with `file_format: mystnb` is a notebook: its code cells run, in an empty folder of
its own, whenever the page is built, and an error in a cell fails the build; so does a command, `!stickslip ...`, that
fails. Pages that are made from the code (`made`) and those of the gallery are written where git does not look.
"""

from __future__ import annotations

import os
import re
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

from sphinx.application import Sphinx  # noqa: E402  (after the path of this folder)

from fmu_models import __version__  # noqa: E402

project = "stickslip"
author = "the stickslip authors"
project_copyright = author
version = release = __version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "mathml", "made.gallery"]
html_math_renderer = "mathml"
exclude_patterns = ["kernel", "made", "site"]
root_doc = "index"

html_theme = "furo"
html_title = f"stickslip {release}"
html_static_path = ["static"]
html_css_files = ["manual.css"]
html_show_sourcelink = html_copy_source = False

myst_enable_extensions = ["dollarmath", "colon_fence", "deflist", "attrs_inline"]
myst_heading_anchors = 3
nb_execution_mode = "auto"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 400  # s of a cell
nb_merge_streams = True
# a command in a cell that goes on on the next line is no Python to the highlighter, and needs no colours
suppress_warnings = ["misc.highlighting_failure"]

# Cells run with settings of ours alone, not with those of the person who builds.
_home = tempfile.TemporaryDirectory(prefix="stickslip-docs-")
_startup = Path(_home.name) / "profile_default" / "startup"
_startup.mkdir(parents=True)
(_startup / "cells.py").write_text((HERE / "kernel" / "cells.py").read_text("utf-8"), "utf-8")
os.environ |= {"IPYTHONDIR": _home.name, "COLUMNS": "96", "TTY_COMPATIBLE": "0", "PYDEVD_DISABLE_FILE_VALIDATION": "1"}
# `!stickslip` is the one of the Python that builds; TTY_COMPATIBLE=0: its progress is no bar that moves
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88
default_role = "code"
napoleon_numpy_docstring = False
napoleon_custom_sections = [("Attributes", "params_style")]  # as a list: fields of a dataclass are members already
napoleon_use_rtype = False


def _make_pages(*_: object) -> None:
    """Write the pages that are made from the code; those that are as they were stay untouched."""
    from made import api, c_abi, cli, formats

    for pages in (api.pages, cli.pages, formats.pages, c_abi.pages):
        for name, text in pages():
            path = HERE / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if not path.is_file() or path.read_text("utf-8") != text:
                path.write_text(text, "utf-8")


def _plain(*given: object) -> None:
    """In docstrings bars and stars are what they mean in formulas, not markup."""
    lines = given[-1]
    assert isinstance(lines, list)
    for number, line in enumerate(lines):
        parts = re.split(r"(``.*?``|`.*?`)", line)
        parts[::2] = [re.sub(r"([|*])", r"\\\1", part) for part in parts[::2]]
        lines[number] = "".join(parts)


def setup(app: Sphinx) -> None:
    """Pages are made before Sphinx looks for them; docstrings are made plain before napoleon reads them."""
    app.connect("config-inited", _make_pages)
    app.connect("autodoc-process-docstring", _plain, priority=100)
