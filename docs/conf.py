"""Sphinx's settings for the manual: `stickslip docs` builds it, or `sphinx-build -W docs build/docs`.

Pages are Markdown. One that begins with `file_format: mystnb` is a notebook: its code cells run, in an empty folder of
its own, whenever the page is built, and an error in a cell fails the build; so does a command, `!stickslip ...`, that
fails. Pages that are made from the code (`made.py`) are written where git does not look.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

from fmu_models import __version__  # noqa: E402  (after the path of this folder)

project = "stickslip"
author = "the stickslip authors"
project_copyright = author
version = release = __version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "mathml", "gallery_pages"]
html_math_renderer = "mathml"
exclude_patterns = ["kernel"]
root_doc = "index"

html_theme = "furo"
html_title = f"stickslip {release}"
html_static_path = ["static"]
html_css_files = ["manual.css"]
html_show_sourcelink = False

myst_enable_extensions = ["dollarmath", "colon_fence", "deflist", "attrs_inline"]
myst_heading_anchors = 3
nb_execution_mode = "auto"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 240
nb_merge_streams = True

# Cells run with settings of ours alone, not with those of the person who builds.
_home = tempfile.TemporaryDirectory(prefix="stickslip-docs-")
_startup = Path(_home.name) / "profile_default" / "startup"
_startup.mkdir(parents=True)
(_startup / "cells.py").write_text((HERE / "kernel" / "cells.py").read_text("utf-8"), "utf-8")
os.environ |= {"IPYTHONDIR": _home.name, "COLUMNS": "110", "PYDEVD_DISABLE_FILE_VALIDATION": "1"}
# `!stickslip` is the one of the Python that builds
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
