"""The studio as a browser meets it: over HTTP, from a process of its own."""

from __future__ import annotations

import html
import http.client
import http.cookiejar
import json
import os
import re
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.parse
import urllib.request
import uuid
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path

import pytest

from identification.studio.forms import arguments, carried, fields
from identification.studio.study import CALL

pytest.importorskip("tornado", reason="tornado is missing: pip install 'stickslip[studio]'")
ROOT = Path(__file__).parents[2]
RIG = ROOT / "data" / "rigs" / "paper_rubber"
PATIENCE = 240.0  # s, for one step on a busy machine


class Visitor:
    """A browser without a screen: cookies, forms and files."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        environment = os.environ | {"PYTHONPATH": str(ROOT)}
        command = [sys.executable, "-c", CALL, "studio", str(folder), "--no-open"]
        self.process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        self.address = re.findall(r"http\S+", self.process.stdout.readline())[0]
        self.base = self.address.partition("/?")[0]
        self.jar = http.cookiejar.CookieJar()
        self.opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(self.jar))
        self.xsrf = re.findall(r'name="_xsrf" value="([^"]+)"', self.get(self.address))[0]

    def get(self, place: str) -> str:
        """A page, by its path or its whole address."""
        with self.opener.open(place if place.startswith("http") else self.base + place, timeout=60) as answer:
            return answer.read().decode()

    def post(self, place: str, **form: str) -> tuple[str, str]:
        """Send a form; where that leads, and the page there."""
        body = urllib.parse.urlencode({**form, "_xsrf": self.xsrf}).encode()
        with self.opener.open(self.base + place, body, timeout=60) as answer:
            return answer.geturl().removeprefix(self.base), answer.read().decode()

    def drop(self, what: str, files: Sequence[tuple[str, bytes]]) -> tuple[str, str]:
        """Drop files on the study."""
        border = uuid.uuid4().hex
        entry = f"--{border}\r\nContent-Disposition: form-data; name="
        parts = [f'{entry}"{name}"\r\n\r\n{value}\r\n' for name, value in (("what", what), ("_xsrf", self.xsrf))]
        body = "".join(parts).encode()
        for name, content in files:
            body += f'{entry}"files"; filename="{name}"\r\n\r\n'.encode() + content + b"\r\n"
        kind = {"Content-Type": f"multipart/form-data; boundary={border}"}
        request = urllib.request.Request(f"{self.base}/upload", body + f"--{border}--\r\n".encode(), kind)
        with self.opener.open(request, timeout=60) as answer:
            return answer.geturl().removeprefix(self.base), answer.read().decode()

    def ended(self, step: str) -> str:
        """The page of a step that has ended; it was done."""
        until = time.monotonic() + PATIENCE
        while (state := json.loads(self.get(f"{step}?only=state")))["status"] == "running":
            assert time.monotonic() < until, state
            time.sleep(0.2)
        page = self.get(step)
        assert state["status"] == "done", page
        return page

    def refused(self, place: str, **headers: str) -> int:
        """The status that a bare request meets, without cookies."""
        with closing(http.client.HTTPConnection(self.base.removeprefix("http://"), timeout=60)) as connection:
            connection.request("GET", place, headers=headers)
            with connection.getresponse() as answer:
                return answer.status

    def close(self) -> int:
        """Ctrl-C at the terminal; the exit code."""
        self.process.send_signal(signal.SIGINT)
        assert self.process.stdout is not None
        self.process.stdout.close()
        return self.process.wait(60)


@pytest.fixture
def visitor(tmp_path: Path) -> Iterator[Visitor]:
    made = Visitor(tmp_path / "study")
    yield made
    if made.process.poll() is None:
        made.close()


def test_a_model_moves_its_line_is_told_and_the_study_repeats_it(visitor: Visitor, stickslip) -> None:
    form = {
        "model": "block_on_belt",
        "until": "2",
        "settings": "mu_s=0.9\nmu_k=0.4",
        "figure": "belt.svg",
        "overwrite": "True",
    }
    page = visitor.get("/give/simulate?first=block_on_belt")
    assert 'value="block_on_belt"' in page and 'name="settings"' in page
    told = json.loads(visitor.post("/give/simulate?only=line", **form)[1])["line"]
    expected = "stickslip simulate block_on_belt --until 2 --set mu_s=0.9 --set mu_k=0.4 --figure belt.svg --overwrite"
    assert sorted(told.split()) == sorted(expected.split())
    where, _ = visitor.post("/give/simulate", **form)
    page = html.unescape(visitor.ended(where))
    assert told in page and 'src="/file/belt.svg"' in page and "/give/explore?after=1" in page
    assert visitor.get("/file/belt.svg").lstrip().startswith("<?xml")
    assert "mu_s=0.9" in visitor.get("/give/diagram?after=1")
    assert visitor.close() == 130
    (visitor.folder / "belt.svg").unlink()
    again = stickslip("run", visitor.folder / "study.toml", "--json")
    assert again.code == 0 and [step["code"] for step in again.json["steps"]] == [0]
    assert (visitor.folder / "belt.svg").is_file()


def test_what_fails_is_told_in_its_words_and_is_no_part_of_the_study(visitor: Visitor) -> None:
    where, _ = visitor.post("/give/simulate", model="blok_on_belt")
    while json.loads(visitor.get(f"{where}?only=state"))["status"] == "running":
        time.sleep(0.1)
    page = html.unescape(visitor.get(where))
    assert "failed (2)" in page and "Did you mean 'block_on_belt'" in page
    assert not (visitor.folder / "study.toml").exists()
    assert "'model' is empty" in html.unescape(visitor.post("/give/simulate", model=" ")[1])


def test_a_step_that_is_stopped_ends_as_by_ctrl_c(visitor: Visitor) -> None:
    where, page = visitor.post("/give/simulate", model="block_on_belt", until="1e7")
    assert "Stop" in page
    time.sleep(3.0)
    visitor.post(where)
    while (state := json.loads(visitor.get(f"{where}?only=state")))["status"] == "running":
        time.sleep(0.1)
    assert state["status"] == "stopped"


def test_who_may_not_ask_gets_nothing(visitor: Visitor) -> None:
    token = next(cookie for cookie in visitor.jar if cookie.name == "stickslip_studio")
    assert token.value and token.has_nonstandard_attr("HttpOnly") and token.get_nonstandard_attr("SameSite") == "Strict"
    known = f"stickslip_studio={token.value}"
    assert visitor.refused("/") == 403
    assert visitor.refused("/?token=wrong") == 403
    assert visitor.refused("/", Cookie="stickslip_studio=wrong") == 403
    assert visitor.refused("/", Cookie=known) == 200
    # a name of somebody else's that leads to this machine
    assert visitor.refused("/", Cookie=known, Host="evil.example:80") == 403
    with pytest.raises(urllib.error.HTTPError, match="403") as forged:
        visitor.opener.open(f"{visitor.base}/give/simulate", b"model=block_on_belt", timeout=60)
    forged.value.close()
    visitor.folder.joinpath("seen.txt").write_text("seen")
    (visitor.folder.parent / "hidden.txt").write_text("hidden")
    assert visitor.get("/file/seen.txt") == "seen"
    for place in ("../hidden.txt", "%2e%2e/hidden.txt", "/etc/hostname", ".studio/1/out", "%2Fetc%2Fhostname"):
        assert visitor.refused(f"/file/{place}", Cookie=known) == 404


def test_dropped_files_stay_in_the_study(visitor: Visitor) -> None:
    where, _ = visitor.drop("model", [("../../away.toml", b"x = 1")])
    assert where == "/give/show?first=away.toml" and (visitor.folder / "away.toml").read_bytes() == b"x = 1"
    for name in (".profile", "study.toml", ".."):
        with pytest.raises(urllib.error.HTTPError) as refused:
            visitor.drop("model", [(name, b"")])
        refused.value.close()


@pytest.mark.nightly
def test_logs_are_described_fitted_reported_and_all_of_it_again(visitor: Visitor, stickslip) -> None:
    logs = [(path.name, path.read_bytes()) for path in sorted(RIG.glob("*.csv"))]
    where, page = visitor.drop("logs", logs)
    assert where == "/describe?folder=logs"
    page = html.unescape(page)
    asked = dict(re.findall(r'name="value ([^"]+)" value="([^"]*)"', page))
    assert {"J", "R", "r", "N0", "laser", "encoder", "drive0"} <= set(asked)
    assert "<svg" in visitor.get("/describe?folder=logs&only=picture")
    wrong = asked | {"J": "heavy"}
    again = visitor.post("/describe", folder="logs", **{f"value {key}": value for key, value in wrong.items()})[1]
    assert 'role="alert"' in again and "'heavy'" in html.unescape(again)
    rig = json.loads((RIG / "datapackage.json").read_text())["rig"]
    of = {key: rig[key] for key in ("J", "R", "r", "N0")}
    said = asked | {key: f"{one['value']} ± {one['standard_uncertainty']} {one['unit']}" for key, one in of.items()}
    said |= {"laser": "0.01 m/V, 5 V", "laser_noise": "20 um", "encoder": "1000", "drive0": "1000"}
    where, _ = visitor.post("/describe", folder="logs", **{f"value {key}": value for key, value in said.items()})
    assert where == "/step/1"
    page = visitor.ended(where)
    assert "/give/fit?after=" in page and 'src="/file/columns.svg"' in page
    form = {"logs": "logs", "estimator": "weak-form", "result": "fit.json", "figure": "friction.svg"}
    fitted = visitor.ended(visitor.post("/give/fit", **form, overwrite="True")[0])
    assert "mu_s" in fitted
    assert 'value="fit.json"' in visitor.get("/give/report?after=2")
    form = {"fitted": "fit.json", "logs": "logs", "residuals": "", "output": "report.html"}
    reported = visitor.ended(visitor.post("/give/report", **form, overwrite="True")[0])
    assert '<iframe src="/file/report.html"' in reported and 'sandbox="allow-scripts' in reported
    visitor.close()
    assert stickslip("run", visitor.folder / "study.toml").code == 0


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[[step]]\nrun = []\n", "a step holds one command"),
        ("[[step]]\nrun = [1]\n", "a step holds one command"),
        ("[step]\nrun = ['show']\n", "in double brackets"),
        ("[[step]]\nrun = ['studio']\n", "'studio' cannot be a step"),
        ("[[step]]\nwalk = ['show']\n", "'walk' is not a key"),
        ("[[step]]\nrun = ['show', 'own.py']\n", "names the Python file 'own.py'"),
        ("[[step]]\nrun = ['show', '--law=own.py']\n", "names the Python file 'own.py'"),
        ("[[step]]\nrun = ['simulate', 'block_on_belt', '-o', '../../run.csv']\n", "lies outside of its folder"),
        ("[[step]]\nrun = ['simulate', 'block_on_belt', '--output=/tmp/run.csv']\n", "lies outside of its folder"),
        ("[[step]]\nrun = ['show', 'no_such_model']\n", "Step 1 of 1 ended with 2"),
    ],
)
def test_a_study_that_cannot_be_run(tmp_path: Path, stickslip, text: str, says: str) -> None:
    (tmp_path / "study.toml").write_text(text)
    answer = stickslip("run", "study.toml")
    assert answer.code == 2 and says in answer.err
    assert not list(tmp_path.glob("*.csv"))


def test_every_command_has_a_form_whose_arguments_it_takes() -> None:
    import typer

    from identification.commands import application

    whole = typer.main.get_command(application.whole())
    for name, command in whole.commands.items():  # type: ignore[attr-defined]
        if name in application.GROUPS:
            continue
        found = fields(command)
        values = {field.name: ["True"] if field.kind == "flag" else ["1"] for field in found}
        line = arguments(name, found, values)
        command.make_context(name, line[1:], resilient_parsing=True)
        assert line[0] == name and len(line) > len([field for field in found if field.required])
        assert all(field.help for field in found), [field.name for field in found if not field.help]


def test_what_goes_on_from_a_fit_to_its_report() -> None:
    import typer

    from identification.commands import application

    command = typer.main.get_command(application.only(["report"])).commands["report"]  # type: ignore[attr-defined]
    values = {"logs": ["logs"], "result": ["fit.json"], "figure": ["friction.svg"], "estimator": ["shooting"]}
    assert carried(values, fields(command)) == {"logs": ["logs"], "fitted": ["fit.json"]}
