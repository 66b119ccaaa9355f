"""The manual's pages as they are written: text, tables and code of the sources, without what only a build computes.

    docs/**/*.md  ->  HTML, a page a file, with a list of all pages beside each

Outputs of examples, the gallery and the reference are missing, and each page says so.
"""

import re
import shutil
from html import escape
from pathlib import Path

from fmu_models.base import shipped

BUILT = ("gallery", "reference", shipped.SITE)  # folders whose pages are made by a build
NOTE = (
    "Pages as they are written: no example was run, gallery and reference are missing. "
    "<code>stickslip docs --build</code> makes all of it, in some minutes; "
    "<code>stickslip COMMAND --help</code> explains a command."
)
STYLE = """
body { font: 1rem/1.5 system-ui, sans-serif; margin: 0 auto; max-width: 80rem; padding: 1rem; display: flex;
  flex-wrap: wrap; gap: 2rem; color: #222; background: #fff; }
nav { flex: 1 1 14rem; font-size: .9rem; } main { flex: 4 1 30rem; min-width: 0; } nav ul { padding-left: 1rem; }
pre { background: #f4f4f4; padding: .7rem; overflow-x: auto; }
table { border-collapse: collapse; display: block; overflow-x: auto; } td, th { padding: .2rem .6rem; text-align: left;
  vertical-align: top; border-bottom: 1px solid #ccc; } img { max-width: 100%; } .note { border-left: 4px solid #888;
  padding-left: .8rem; } a { color: #0b5394; }
"""
TOCTREE = re.compile(r"^```\{toctree\}\n(.*?)^```\n", re.M | re.S)


def write(site: Path) -> None:
    """Write all pages into a new folder, with their pictures."""
    from markdown_it import MarkdownIt

    shutil.copytree(shipped.manual() / "static", site / "static")
    pages = _pages()
    titles = {name: re.sub(r"^# ", "", _text(source).split("\n", 1)[0]) for name, source in pages.items()}
    markdown = MarkdownIt("commonmark").enable("table")
    for name, source in pages.items():
        up = "../" * name.count("/")
        body = markdown.render(TOCTREE.sub(lambda tree, name=name: _linked(tree[1], name, titles), _text(source)))
        body = re.sub(r'(<a href="(?!\w+:)[^"#]*)\.md', r"\1.html", body)
        body = re.sub(r"<h([1-4])>(.*?)</h\1>", _anchored, body)
        entries = "".join(f'<li><a href="{up}{other}.html">{escape(title)}</a></li>' for other, title in titles.items())
        path = site / f"{name}.html"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(
            f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(titles[name])}</title>'
            f'<meta name="viewport" content="width=device-width, initial-scale=1"><style>{STYLE}</style></head>'
            f'<body><main><p class="note">{NOTE}</p>\n{body}</main><nav aria-label="Pages"><ul>{entries}</ul></nav>'
            "</body></html>\n",
            "utf-8",
        )


def _pages() -> dict[str, str]:
    """Markdown by names without suffix; the first page first."""
    folder = shipped.manual()
    paths = sorted(folder.rglob("*.md"), key=lambda path: (path.parent != folder, path.name != "index.md", path))
    named = {path.relative_to(folder).with_suffix("").as_posix(): path for path in paths}
    return {name: path.read_text("utf-8") for name, path in named.items() if name.split("/")[0] not in BUILT}


def _text(source: str) -> str:
    """A page without its head; cells of code are code."""
    body = re.sub(r"\A---\n.*?\n---\n+", "", source, flags=re.S)
    return re.sub(r"^```\{code-cell\}.*", "```python", body, flags=re.M)


def _linked(tree: str, page: str, titles: dict[str, str]) -> str:
    """A tree of pages as a list of links to those that are there, under its caption."""
    folder = page.rpartition("/")[0]
    lines = []
    for line in tree.splitlines():
        name = f"{folder}/{line}".lstrip("/")
        if caption := re.match(":caption: (.*)", line):
            lines += [f"## {caption[1]}", ""]
        elif name in titles:
            lines.append(f"- [{titles[name]}]({line}.md)")
    return "\n".join(lines) + "\n"


def _anchored(heading: re.Match[str]) -> str:
    """A heading with the place that links of the manual name."""
    words = re.sub(r"[^\w\- ]", "", re.sub(r"<[^>]*>", "", heading[2])).lower().replace(" ", "-")
    return f'<h{heading[1]} id="{words}">{heading[2]}</h{heading[1]}>'
