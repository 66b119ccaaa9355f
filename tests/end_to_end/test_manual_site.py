"""The manual as a site: built without a warning, its examples run, its links hold, and it asks nobody for anything."""

from __future__ import annotations

import html.parser
import importlib.util
import json
import os
import re
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from made.gallery_jobs import CALIBRATIONS

from fmu_models.base import shipped
from fmu_models.oscillators import MODELS
from fmu_models.report import plain_manual
from fmu_models.report.manual import KEPT, NEEDED, forget_old, manual_site
from fmu_models.scene.read import files

# what a browser fetches by itself; a link in the text waits for a click
FETCHED = {"img": "src", "script": "src", "iframe": "src", "link": "href", "source": "src", "object": "data"}
DOCS = Path(__file__).parents[2] / "docs"
NO_FETCH = {"canonical", "next", "prev", "index", "search", "author", "copyright", "top", "up"}


class Page(html.parser.HTMLParser):
    """What a page links to and fetches, its places and its titles."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.fetched: list[str] = []
        self.places: set[str] = set()
        self.titles: dict[str, str] = {}
        self._inside: str | None = None
        self.text = path.read_text("utf-8")
        self.feed(self.text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.places |= {given[name] for name in ("id", "name") if name in given}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        elif given.get(FETCHED.get(tag, "")) and given.get("rel") not in NO_FETCH:
            self.fetched.append(given[FETCHED[tag]])
        if tag in ("title", "h1"):
            self._inside = tag

    def handle_endtag(self, tag: str) -> None:
        if tag == self._inside:
            self._inside = None

    def handle_data(self, data: str) -> None:
        if self._inside:
            self.titles[self._inside] = self.titles.get(self._inside, "") + data.strip()


def faults(pages: Mapping[Path, Page], site: Path) -> list[str]:
    """Links into nothing, what is fetched from elsewhere, pages without a title."""
    found = []
    for path, page in pages.items():
        where = path.relative_to(site).as_posix()
        for address in [*page.links, *page.fetched]:
            parts = urlsplit(address)
            if parts.scheme or parts.netloc:
                if address in page.fetched and parts.scheme != "data":
                    found.append(f"{where} fetches {address}")
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            other = pages.get(target)
            if not target.is_file():
                found.append(f"{where}: {address} is not there")
            elif other and parts.fragment and not _there(other, unquote(parts.fragment)):
                found.append(f"{where}: {address} has no such place")
        # the page of the search writes its heading by script
        if not all(page.titles.get(tag) for tag in ("title", "h1") if (path.name, tag) != ("search.html", "h1")):
            found.append(f"{where} has no title")
    return found


def _there(page: Page, place: str) -> bool:
    # a live page is told its values behind the mark
    return place in page.places or "state=" in place or "{" in place


def read(site: Path) -> dict[Path, Page]:
    return {path.resolve(): Page(path) for path in sorted(site.rglob("*.html"))}


@pytest.mark.nightly
def test_the_manual_is_built_and_holds_together(stickslip) -> None:
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        pytest.skip(f"not installed: {', '.join(missing)}; pip install 'stickslip[docs]'")
    site = manual_site(strict=True).folder
    pages = read(site)
    assert not faults(pages, site)
    named = {path.relative_to(site).as_posix() for path in pages}
    assert {"index.html", "search.html", "genindex.html", "reference/commands.html", "reference/scene.html"} <= named
    assert {f"gallery/scenes/{path.stem}.html" for path in files()} <= named
    assert {f"gallery/calibrations/{case.name}.html" for case in CALIBRATIONS} <= named
    assert {f"gallery/{part}/{name}.html" for name in MODELS.members() for part in ("oscillators", "live")} <= named
    index = json.loads(re.sub(r"^Search\.setIndex\((.*)\)$", r"\1", (site / "searchindex.js").read_text("utf-8")))
    live = {name for name in named if name.startswith("gallery/live/")}
    assert named - live - {f"{name}.html" for name in index["docnames"]} <= {"search.html", "genindex.html"}
    assert index["terms"].keys() >= {"graze", "stick"}
    for sheet in site.rglob("*.css"):
        assert not re.search(r"(@import|url\()\s*['\"]?(https?:)?//", sheet.read_text("utf-8")), sheet
    # what was built is what the command opens, and copies
    said = stickslip("docs", "--no-open", "--json", "-o", "manual").json
    assert (said["built"], said["opened"], said["pages"]) == (False, False, len(pages))
    assert Path(said["index"]).read_text("utf-8") == (site / "index.html").read_text("utf-8")
    taken = stickslip("docs", "--no-open", "-o", "manual")
    assert taken.code == 2 and "holds something already" in taken.err


def test_a_checkout_opens_its_pages_as_they_are_written(stickslip, monkeypatch, tmp_path) -> None:
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path))
    said = stickslip("docs", "--no-open", "--json").json
    site = Path(said["index"]).parent
    pages = read(site)
    assert (said["plain"], said["built"], said["pages"]) == (True, True, len(pages))
    assert not faults(pages, site)
    written = {path.relative_to(DOCS).with_suffix(".html") for path in DOCS.rglob("*.md")}
    shown = {path.relative_to(site.resolve()) for path in pages}
    assert shown == {path for path in written if path.parts[0] not in plain_manual.BUILT}
    tutorial = pages[(site / "tutorials" / "logs_to_a_fit.html").resolve()].text
    assert '<code class="language-python">!stickslip data copy' in tutorial and "{code-cell}" not in tutorial
    assert '<h2 id="logs-and-fits">' in pages[(site / "how_to" / "index.html").resolve()].text
    again = stickslip("docs", "--no-open")
    assert again.code == 0 and "--build" in again.out
    assert not stickslip("docs", "--no-open", "--json").json["built"]


def test_an_installed_suite_opens_the_manual_that_it_brings(stickslip, monkeypatch, tmp_path) -> None:
    site = tmp_path / "stickslip_docs" / shipped.SITE
    site.mkdir(parents=True)
    (site / "index.html").write_text("built", "utf-8")
    monkeypatch.setattr(shipped, "site", lambda: site)
    said = stickslip("docs", "--no-open", "--json").json
    assert (said["index"], said["plain"], said["built"]) == (str(site / "index.html"), False, False)


def test_faults_of_pages_are_seen(tmp_path) -> None:
    whole = "<html><head><title>A</title></head><body><h1 id='a'>A</h1>{}</body></html>"
    body = "<a href='#a'>1</a><a href='b.html#c'>2</a><a href='d.html'>3</a><img src='https://e.org/f.png'>"
    (tmp_path / "a.html").write_text(whole.format(body), "utf-8")
    (tmp_path / "b.html").write_text(whole.replace("<h1 id='a'>A</h1>", ""), "utf-8")
    found = faults(read(tmp_path), tmp_path.resolve())
    assert found == [
        "a.html: b.html#c has no such place",
        "a.html: d.html is not there",
        "a.html fetches https://e.org/f.png",
        "b.html has no title",
    ]


def test_the_sites_built_last_are_kept(tmp_path) -> None:
    for number in range(KEPT + 2):
        site = tmp_path / f"manual-{9 - number}"
        site.mkdir()
        (site / "index.html").touch()
        os.utime(site, (number, number))
    forget_old(tmp_path)
    assert {site.name for site in tmp_path.iterdir()} == {f"manual-{9 - number}" for number in range(2, KEPT + 2)}


def test_without_sphinx_the_command_says_what_to_install(tmp_path) -> None:
    code = (
        "import sys; sys.modules['sphinx'] = None; sys.argv = ['stickslip', 'docs', '--build', '--no-open']\n"
        "from identification.cli import main; main()"
    )
    environment = os.environ | {"STICKSLIP_CACHE": str(tmp_path)}
    line = [sys.executable, "-c", code]
    answer = subprocess.run(line, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert answer.returncode == 2 and "pip install 'stickslip[docs]'" in answer.stderr, answer.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("page", sorted(DOCS.rglob("*.md")), ids=lambda page: page.relative_to(DOCS).as_posix())
def test_a_page_read_in_the_repository_links_to_files_that_are_there(page: Path) -> None:
    links = re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text("utf-8"))
    assert not [link for link in links if not urlsplit(link).scheme and not (page.parent / link).exists()]
