"""The studio as a browser meets it: over HTTP, from a process of its own."""

from __future__ import annotations

import html
import json
import re
import shutil
import time
import urllib.error
import urllib.parse
from collections.abc import Iterator
from pathlib import Path

import pandas
import pytest
from visitor import Visitor

from fmu_models.fmu.load import load
from identification.studio.forms import Field, arguments, carried, fields, groups, proposals
from identification.studio.places import begun_at, place_of

pytest.importorskip("tornado", reason="tornado is missing: pip install 'stickslip[studio]'")
RIG = Path(__file__).parents[2] / "data" / "rigs" / "paper_rubber"


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
    # another port of this machine, which browsers send cookies to as well; a frame without rights; another site
    for headers in ({"Origin": "http://127.0.0.1:1"}, {"Origin": "null"}, {"Sec-Fetch-Site": "same-site"}):
        assert visitor.refused("/step/1", Cookie=known, **headers) == 403
        assert visitor.refused("/file/study.toml", Cookie=known, **headers) == 403
    with pytest.raises(urllib.error.HTTPError, match="403") as forged:
        visitor.opener.open(f"{visitor.base}/give/simulate", b"model=block_on_belt", timeout=60)
    forged.value.close()
    visitor.folder.joinpath("seen.txt").write_text("seen")
    (visitor.folder.parent / "hidden.txt").write_text("hidden")
    assert visitor.get("/file/seen.txt") == "seen"
    (visitor.folder / "link.txt").symlink_to(visitor.folder.parent / "hidden.txt")
    outside = ("../hidden.txt", "%2e%2e/hidden.txt", "/etc/hostname", "%2Fetc%2Fhostname", "link.txt")
    for place in (*outside, ".studio/1/out", "%00", "seen.txt%00", "a" * 5000):
        assert visitor.refused(f"/file/{place}", Cookie=known) == 404
    assert "link.txt" not in visitor.get("/")


def test_a_body_is_not_taken_from_who_may_not_send_it(visitor: Visitor) -> None:
    cookies = "; ".join(f"{cookie.name}={cookie.value}" for cookie in visitor.jar)
    place = f"/upload?_xsrf={urllib.parse.quote(visitor.xsrf)}"
    size = 200 << 20
    for headers in ({}, {"Cookie": cookies, "Origin": "http://127.0.0.1:1"}, {"Cookie": "stickslip_studio=wrong"}):
        assert visitor.announced(size, place, **headers).startswith(b"HTTP/1.1 403 ")
    assert visitor.announced(size, Cookie=cookies).startswith(b"HTTP/1.1 403 ")  # no form of this page
    assert visitor.announced(size, "/give/simulate", Cookie=cookies).startswith(
        b"HTTP/1.1 400 "
    )  # no other form is so long
    assert visitor.announced(300 << 20, place, Cookie=cookies).startswith(b"HTTP/1.1 400 ")
    assert visitor.announced(size, place, Cookie=cookies) == b""  # it waits for the body


def test_pages_say_what_browsers_may_do_with_them(visitor: Visitor) -> None:
    with visitor.opener.open(f"{visitor.base}/", timeout=60) as answer:
        policy = answer.headers["Content-Security-Policy"]
        assert answer.headers["Cross-Origin-Resource-Policy"] == "same-origin"
    assert {"default-src 'self'", "frame-ancestors 'none'", "base-uri 'none'"} <= {*policy.split("; ")}
    visitor.folder.joinpath("page.html").write_text("<script>fetch('/')</script>")
    with visitor.opener.open(f"{visitor.base}/file/page.html", timeout=60) as answer:
        policy = answer.headers["Content-Security-Policy"]
        assert policy.startswith("sandbox ") and "allow-same-origin" not in policy


def test_dropped_files_stay_in_the_study(visitor: Visitor) -> None:
    where, _ = visitor.drop("model", [("../../away.toml", b"x = 1")])
    assert where == "/give/scene?first=away.toml" and (visitor.folder / "away.toml").read_bytes() == b"x = 1"
    # by a link that was there already, too
    (visitor.folder / "link.toml").symlink_to(visitor.folder.parent / "away.toml")
    for name in (".profile", "study.toml", "..", "link.toml"):
        assert visitor.fault_of("model", name, b"")
    assert not (visitor.folder.parent / "away.toml").exists()
    # a link is no file of the study, and neither keeps a command from its work
    visitor.ended(visitor.post("/give/show", model="block_on_belt")[0])


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("photo.csv", b"\x89PNG\r\n\x1a\n\0\0", "photo.csv"),
        ("empty.csv", b"", "empty.csv"),
        ("heading.csv", b"t,laser\n", "heading.csv"),
    ],
)
def test_logs_that_cannot_be_read_are_told_and_not_kept(visitor: Visitor, name: str, content: bytes, says: str) -> None:
    told = visitor.fault_of("logs", name, content)
    assert says in told and "is not kept" in told
    assert not list((visitor.folder / "logs").iterdir())


def test_a_document_that_cannot_be_read_is_told_and_not_kept(visitor: Visitor) -> None:
    told = visitor.fault_of("model", "broken.toml", b"[units\n")
    assert "broken.toml" in told and "is not kept" in told and not (visitor.folder / "broken.toml").exists()


def test_a_log_that_cannot_be_read_replaces_none(visitor: Visitor) -> None:
    kept = visitor.folder / "logs" / "run.csv"
    kept.parent.mkdir(exist_ok=True)
    kept.write_text("t,laser\n0,1\n")
    assert visitor.fault_of("logs", "run.csv", b"")
    assert kept.read_text() == "t,laser\n0,1\n"
    kept.unlink()


def test_a_study_whose_room_leads_elsewhere_is_not_opened(tmp_path: Path, stickslip) -> None:
    (tmp_path / "study").mkdir()
    (tmp_path / "study" / ".studio").symlink_to(tmp_path)
    answer = stickslip("studio", "study", "--no-open")
    assert answer.code == 2 and "'.studio' lies outside" in answer.err


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


def form_of(name: str) -> list[Field]:
    """The fields of a command."""
    import typer

    from identification.commands import application

    return fields(typer.main.get_command(application.only([name])).commands[name])  # type: ignore[attr-defined]


def test_what_goes_on_from_a_fit_to_its_report() -> None:
    values = {"logs": ["logs"], "result": ["fit.json"], "figure": ["friction.svg"], "estimator": ["shooting"]}
    values["uncertainty"] = [""]  # a flag of the report is called the same
    assert carried(values, form_of("report")) == {"logs": ["logs"], "fitted": ["fit.json"]}
    assert carried({"model": ["belt"], "path": ["belt.html"]}, form_of("export")) == {"model": ["belt"]}
    assert proposals("apply", form_of("apply"))["output"] == ["fitted.fmu"]


def test_an_fmu_is_dropped_looked_into_and_run(visitor: Visitor) -> None:
    where, page = visitor.drop("model", [("belt.fmu", load("block_on_belt").path.read_bytes())])
    assert where == "/give/inspect?first=belt.fmu" and 'value="belt.fmu"' in page
    page = visitor.ended(visitor.post("/give/inspect", path="belt.fmu")[0])
    assert "/give/simulate?after=1" in page
    assert re.search(r'name="model" value="belt.fmu"', visitor.get("/give/simulate?after=1"))
    # what a command has made is what the next one is of
    page = visitor.ended(visitor.post("/give/export", model="block_on_belt", path="made.fmu")[0])
    assert re.search(r'name="path" value="made.fmu"', visitor.get("/give/inspect?after=2"))


def test_a_scene_is_dropped_computed_and_exported(visitor: Visitor) -> None:
    scene = RIG.parents[1] / "scenes" / "disc_rig_class_a.toml"
    where, page = visitor.drop("model", [("own.toml", scene.read_bytes())])
    assert where == "/give/scene?first=own.toml" and re.search(r'name="path" value="own.toml"', page)
    page = visitor.ended(visitor.post("/give/scene", path="own.toml")[0])
    assert "against what is known" in page and "/give/export?after=1" in page
    assert re.search(r'name="model" value="own.toml"', visitor.get("/give/export?after=1"))
    page = visitor.ended(visitor.post("/give/export", model="own.toml", path="own.fmu")[0])
    assert "parameters none" in page and (visitor.folder / "own.fmu").is_file()
    where, _ = visitor.drop("model", [("pair.toml", b"[units.belt]\nmodel = 'block_on_belt'\n")])
    assert where == "/give/couple?first=pair.toml"


def test_a_fit_is_written_into_a_scene_of_the_suite_and_that_shown(visitor: Visitor) -> None:
    shutil.copytree(RIG, visitor.folder / "logs")
    visitor.ended(visitor.post("/give/fit", logs="logs", estimator="weak-form", result="fit.json")[0])
    form = {"fitted": "fit.json", "source": "disc_rig_class_a", "output": "fitted.toml"}
    page = visitor.ended(visitor.post("/give/apply", **form)[0])
    assert "fitted.toml" in page
    assert re.search(r'name="model" value="fitted.toml"', visitor.get("/give/explore?after=2"))
    assert re.search(r'name="path" value="fitted.toml"', visitor.get("/give/scene?after=2"))


def test_a_place_in_a_picture_is_a_point_of_the_result(tmp_path: Path, stickslip) -> None:
    over = ("--over", "omega=0.8:1.4:7", "--output", "d.csv", "--figure", "d.svg")
    assert stickslip("diagram", "discontinuous_support", "--forcing", "omega", *over).code == 0
    place = place_of(tmp_path, ("d.csv", "d.svg"))
    assert place is not None and place.axes == ("omega", "x") and place.parameters == ("omega",)
    # the frame of the axes as the picture draws it
    text = (tmp_path / "d.svg").read_text()
    frame = re.findall(r'<g id="patch_2">\s*<path d="M (\S+) (\S+) \sL (\S+) \S+ \sL \S+ (\S+)', text)[0]
    width, height = re.findall(r'viewBox="0 0 (\S+) (\S+)"', text)[0]
    sizes = (float(width), float(height)) * 2
    assert place.box == pytest.approx([float(edge) / size for edge, size in zip(frame, sizes, strict=True)], abs=1e-5)
    rows = pandas.read_csv(tmp_path / "d.csv")
    row = rows[rows.omega == rows.omega[2]].iloc[0]
    found = place.values({"omega": row.omega + 0.01, "x": row.x + 0.1})
    assert found == {"omega": row.omega + 0.01, "x": row.x, "v": row.v}
    assert place.values({"omega": 1.2})["omega"] == 1.2
    form = form_of("branch")
    values: dict[str, list[str]] = {"settings": ["ks=300\nomega=1"]}
    begun_at(place, {"omega": 1.0, "x": row.x}, "branch", form, values)
    assert values["settings"] == ["ks=300", "omega=1.0"] and len(values["start"]) == 2
    low, high = place.limits[0]
    assert values["over"] == [f"omega={low:.4g}:{high:.4g}"]
    begun_at(place, {}, "basins", form_of("basins"), values)
    assert [text.partition("=")[0] for text in values["over"]] == ["x", "v"]


def test_a_place_in_a_picture_of_equilibria(tmp_path: Path, stickslip) -> None:
    words = ("planar_hopf", "--over", "mu=-1:1", "--start", "x1=-1.5", "--start", "x2=0")
    for of in ("x1", "eigenvalues"):
        files = ("--output", f"{of}.csv", "--figure", f"{of}.svg")
        assert stickslip("equilibria", *words, "--of", of, *files).code == 0
    assert place_of(tmp_path, ("eigenvalues.svg",)) is None
    place = place_of(tmp_path, ("x1.csv", "x1.svg"))
    assert place is not None and place.axes == ("mu", "x1") and place.states == ("x1", "x2")
    rows = pandas.read_csv(tmp_path / "x1.csv")
    row = rows.iloc[len(rows) // 3]
    assert place.values({"mu": row.mu, "x1": row.x1}) == pytest.approx(dict(row[["mu", "x1", "x2"]]), abs=1e-12)
    assert proposals("equilibria", form_of("equilibria"))["output"] == ["equilibria.csv"]


def test_a_form_begins_with_what_matters() -> None:
    parts = groups(form_of("diagram"), {"output": ["d.csv"], "every": ["2"], "period": [""]})
    assert [field.name for field in parts[""]][:4] == ["model", "over", "forcing", "period"]
    assert "every" in [field.name for field in parts[""]]  # it is said
    assert [field.name for field in parts["Files"]] == ["output", "figure", "interactive", "overwrite"]
    assert {"contacts", "workers"} <= {field.name for field in parts["More options"]}
