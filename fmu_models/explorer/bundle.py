"""Scripts, style and packed bytes as one page that asks the network for nothing, and such a page in a frame."""

import base64
import gzip
import hashlib
import re
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

WEB = Path(__file__).parent / "web"


def single_file(template: Path, scripts: Sequence[Path], style: str, packed: Mapping[str, bytes], **values: Any) -> str:
    """A page from its template, with the hashes of its scripts in its policy.

    Args:
        template: is given ``policy``, ``style``, ``boot``, ``script``, ``packed`` by name, and ``values``.
        scripts: modules in the order in which they need each other; the last exports ``open``, which begins.
        packed: what the page unpacks by ``unpacked(id)``.
    """
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(template.parent),
        autoescape=True,
        trim_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    script, boot = _script(scripts), _plain(WEB / "boot.js")
    policy = (
        f"default-src 'none'; script-src {_hash(boot)} {_hash(script)} 'wasm-unsafe-eval'; style-src {_hash(style)}; "
        "img-src data: blob:; worker-src blob:; base-uri 'none'; form-action 'none'"
    )
    sections = {"policy": policy, "style": style, "boot": boot, "script": _packed(script.encode())}
    shrunk = {name: _packed(content) for name, content in packed.items()}
    return environment.get_template(template.name).render(**sections, packed=shrunk, **values)


def framed(page: str, title: str, height: int = 900) -> str:
    """A page in a frame of its own, which reaches neither what is around it nor the network. height: in pixels."""
    return (
        f'<iframe sandbox="allow-scripts allow-downloads" width="100%" height="{height}" title="{escape(title)}" '
        f'style="border:0" srcdoc="{escape(page, quote=True)}"></iframe>'
    )


def _script(files: Sequence[Path]) -> str:
    """The modules as one; comments and indents are left out."""
    scripts = []
    for file in files:
        text = re.sub(r"^import .*;\n", "", _plain(file), flags=re.M)
        scripts.append(re.sub(r"^export ", "", text, flags=re.M))
    return "".join(scripts) + "open();\n"


def _plain(file: Path) -> str:
    """A script without comments and indents."""
    text = re.sub(r"^\s*//.*\n", "", file.read_text("utf-8"), flags=re.M)
    return re.sub(r"^ +", "", text, flags=re.M)


def _packed(content: bytes) -> str:
    """Compressed, as text; without the time of day, so that a page of the same model has the same bytes."""
    return base64.b64encode(gzip.compress(content, 9, mtime=0)).decode()


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
