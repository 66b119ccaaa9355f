"""Pages of the studio over HTTP, on this machine alone.

Who may ask: whoever opened the address with its token, which becomes a cookie that no other site's page sends; for the
host that is this machine by name or number; from no page but these, other ports of this machine included; with a
form's own token where something is to be done. Files are those of the study's folder, and no links that lead out of it.
What a command wrote runs in a frame without this page's rights.
"""

from __future__ import annotations

import asyncio
import hmac
import mimetypes
import secrets
from collections.abc import Callable, Mapping
from pathlib import Path, PurePosixPath
from types import MappingProxyType
from typing import Any
from urllib.parse import urlencode

import jinja2
import tornado.http1connection
import tornado.httpserver
import tornado.netutil
import tornado.web

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.version import version
from fmu_models.oscillators import MODELS
from identification.studio import forms, questions
from identification.studio.places import AT, begun_at, place_of
from identification.studio.steps import ROOM, Steps, files_of
from identification.studio.study import NO_STEPS, STUDY, line

LOOPBACK = "127.0.0.1"
COOKIE = "stickslip_studio"
LARGEST = 1 << 28  # bytes of what is dropped at once, which are held in memory
FORM = 1 << 20  # bytes of any other form
LOGS = "logs"  # what is dropped, and the folder that it is put in
PICTURES = (".svg", ".png")
POLICY = (
    "default-src 'self'; img-src 'self' data:; base-uri 'none'; object-src 'none'; form-action 'self'; "
    "frame-ancestors 'none'"
)
OWN = ("same-origin", "none")  # who asks, as browsers say: a page of this server, or a person
# of pages and pictures that commands wrote: their scripts run, with no right to ask this server for anything
APART = "sandbox allow-scripts allow-downloads; frame-ancestors 'self'"
FIRST = ("explore", "show", "simulate", "diagram", "inspect", "export")


class Desk:
    """What all pages share: a folder and its steps, the commands, the token, the templates."""

    def __init__(self, folder: Path, commands: Mapping[str, str], command: Callable[[str], Any]) -> None:
        """commands: what each does, by name; command: that of a name, as typer makes it."""
        self.folder = folder.resolve()
        self.inside(ROOM)
        self.drafts = questions.Drafts()
        self.steps = Steps(self.folder)
        self.commands = {name: text for name, text in commands.items() if name not in NO_STEPS}
        self.command = command
        self.token = secrets.token_urlsafe(32)
        loader = jinja2.FileSystemLoader(Path(__file__).parent / "web")
        self.pages = jinja2.Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
        self.pages.undefined = jinja2.StrictUndefined

    def fields(self, name: str) -> list[forms.Field]:
        """Fields of a command. StickslipError: there is none of that name."""
        if name not in self.commands:
            raise StickslipError(f"There is no command '{name}' for a study.{nearest(name, self.commands)}")
        return forms.fields(self.command(name))

    def place(self, name: str) -> Path:
        """A file of the study. StickslipError: outside of it, hidden, or not there."""
        path = self.inside(name)
        if not path.is_file() or any(part.startswith(".") for part in PurePosixPath(name).parts):
            raise StickslipError(f"There is no file '{name}' in this study.")
        return path

    def inside(self, name: str) -> Path:
        """A path in the study, links followed. StickslipError: it leads out of it, or cannot be one."""
        try:
            path = (self.folder / name).resolve()
            path.exists()
        except (OSError, ValueError) as error:
            raise StickslipError(f"No file can be called '{name[:40]}'.") from error
        if not path.is_relative_to(self.folder):
            raise StickslipError(f"'{name}' lies outside of this study.")
        return path


class Page(tornado.web.RequestHandler):
    """What holds for every page."""

    def initialize(self, desk: Desk) -> None:
        """Of tornado."""
        self.desk = desk

    def prepare(self) -> None:
        """Let in who may ask."""
        host = self.request.host.rpartition(":")[0] or self.request.host
        if host not in (LOOPBACK, "localhost"):
            raise tornado.web.HTTPError(403, reason="Other hosts have nothing here")
        own = f"{self.request.protocol}://{self.request.host}"
        if self.request.headers.get("Origin", own) != own:
            raise tornado.web.HTTPError(403, reason="Pages of others have nothing here")
        if self.request.path == "/" and (token := self.get_query_argument("token", "")):
            if not hmac.compare_digest(token.encode(), self.desk.token.encode()):
                raise tornado.web.HTTPError(403, reason="The token is another")
            self.set_cookie(COOKIE, token, httponly=True, samesite="Strict")
            self.redirect("/")
            return
        if self.request.headers.get("Sec-Fetch-Site", "none") not in OWN:
            raise tornado.web.HTTPError(403, reason="Pages of others have nothing here")
        if not hmac.compare_digest(self.get_cookie(COOKIE, "").encode(), self.desk.token.encode()):  # type: ignore[union-attr]
            raise tornado.web.HTTPError(403, reason="Open the address that the terminal shows")

    def set_default_headers(self) -> None:
        """Of tornado."""
        self.set_header("Content-Security-Policy", POLICY)
        self.set_header("X-Content-Type-Options", "nosniff")
        self.set_header("Referrer-Policy", "same-origin")
        self.set_header("Cross-Origin-Resource-Policy", "same-origin")
        self.set_header("Cache-Control", "no-store")

    def show(self, template: str, **values: Any) -> None:
        """Write a page."""
        common = {"folder": self.desk.folder.name, "version": version(), "xsrf": self.xsrf_token.decode()}
        self.finish(self.desk.pages.get_template(template).render(**common, **values))

    def write_error(self, status_code: int, **details: Any) -> None:
        """A page for what went wrong; of what a user did, the sentence."""
        if status_code == 403:  # nothing of the study
            self.finish(f"{self._reason}.")
            return
        error = details.get("exc_info", (None, None, None))[1]
        if isinstance(error, StickslipError):
            self.set_status(404)
        text = str(error) if isinstance(error, StickslipError) else self._reason
        self.show("error.html", title="Not done", text=text)

    def log_exception(self, typ: Any, value: Any, tb: Any) -> None:
        """Faults of the page itself alone."""
        if not isinstance(value, StickslipError):
            super().log_exception(typ, value, tb)

    def form(self) -> dict[str, list[str]]:
        """What was filled in."""
        sent = self.request.body_arguments
        return {name: [text.decode("utf-8", "replace") for text in sent[name]] for name in sent if name != "_xsrf"}


class Index(Page):
    """The study: what to begin with, its steps and files."""

    def get(self) -> None:
        """Show it."""
        steps = self.desk.steps.all()
        parts = {"files": files_of(self.desk.folder), "commands": self.desk.commands, "models": MODELS.names()}
        self.show("index.html", steps=steps, first=FIRST, largest=LARGEST, **parts)


@tornado.web.stream_request_body
class Upload(Page):
    """Files that are dropped: logs into their folder, others beside them. The form's token is in the address: who may
    ask is known before the body is taken."""

    def prepare(self) -> None:
        """Take a body, once it may be sent."""
        super().prepare()
        self._connection.set_max_body_size(LARGEST + FORM)
        self.body = bytearray()

    def data_received(self, chunk: bytes) -> None:
        """Of tornado: the next part of the body."""
        self.body += chunk

    def write_error(self, status_code: int, **details: Any) -> None:
        """As of every page; what is refused before its body came is not read."""
        if status_code == 403:
            self._connection.set_max_body_size(0)
        super().write_error(status_code, **details)

    @property
    def _connection(self) -> tornado.http1connection.HTTP1Connection:
        assert isinstance(self.request.connection, tornado.http1connection.HTTP1Connection)
        return self.request.connection

    async def post(self) -> None:
        """Keep them, and go on with what they are. What cannot be read is not kept: all other logs would wait."""
        self.request.body = bytes(self.body)
        self.request._parse_body()
        files = self.request.files.get("files", [])
        if not files:
            raise StickslipError("No file was chosen.")
        are_logs = self.get_body_argument("what", "") == LOGS
        folder = _plain(self.get_body_argument("folder", LOGS)) if are_logs else ""
        bodies = {self.desk.inside(f"{folder}/{_plain(file.filename)}".lstrip("/")): file.body for file in files}
        before = {path: path.read_bytes() if path.exists() else None for path in bodies}
        for path, body in bodies.items():
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(body)
        try:
            if are_logs:
                await asyncio.to_thread(self.desk.drafts.of, self.desk.folder, folder)
                page = f"describe?{urlencode({'folder': folder})}"
            else:
                first, *_ = [forms.looking_into(path) for path in bodies]
                page = f"give/{first}?{urlencode({'first': next(iter(bodies)).name})}"
        except StickslipError as error:
            for path, body in before.items():
                path.unlink() if body is None else path.write_bytes(body)
            kind = "logs" if are_logs else "files"
            raise StickslipError(f"{error} What was dropped is not kept; drop {kind} that can be read.") from error
        self.redirect(f"/{page}")


def _plain(name: str) -> str:
    """The last part of a file's name. StickslipError: hidden, or the study itself."""
    last = PurePosixPath(name.strip().replace("\\", "/")).name
    if not last or last.startswith(".") or last == STUDY:
        raise StickslipError(f"A file cannot be called '{name}'. Give it another name.")
    return last


class Describe(Page):
    """The questions on logs."""

    async def get(self) -> None:
        """Ask them, or draw the columns."""
        folder = self.get_query_argument("folder", LOGS)
        made = await self._read(folder)
        if self.get_query_argument("only", "") == "picture":
            self.set_header("Content-Type", "image/svg+xml")
            self.finish(await asyncio.to_thread(questions.picture, made))
        else:
            self._ask(questions.asked(made, folder))

    async def post(self) -> None:
        """Take the answers; once nothing is open the command runs."""
        folder = self.get_body_argument("folder", LOGS)
        made = await self._read(folder)
        said = {name: values[-1] for name, values in self.form().items()}
        answers, faults = questions.answer(made, said)
        after = questions.asked(self.desk.drafts.answered(self.desk.folder, folder, made, answers), folder, faults)
        if faults or any(not question.proposal for question in after.questions):
            self._ask(after, said)
            return
        arguments = ["describe", folder, "--answers", f"{folder}/{questions.ANSWERS}", "--figure", "columns.svg"]
        number = self.desk.steps.begin([*arguments, "--overwrite"], {"files": [folder]})
        self.redirect(f"/step/{number}")

    async def _read(self, folder: str) -> Any:
        if not self.desk.inside(folder).is_dir():
            raise StickslipError(f"There is no folder '{folder}' in this study.")
        return await asyncio.to_thread(self.desk.drafts.of, self.desk.folder, folder)

    def _ask(self, asked: questions.Asked, said: Mapping[str, str] = MappingProxyType({})) -> None:
        picture = f"/describe?{urlencode({'folder': asked.folder, 'only': 'picture'})}"
        self.show("describe.html", title="What the logs are", asked=asked, said=said, picture=picture)


class Give(Page):
    """The form of a command."""

    def get(self, name: str) -> None:
        """Show it, with what goes over from the step before."""
        fields = self.desk.fields(name)
        values = forms.proposals(name, fields)
        if (before := self.get_query_argument("after", "")).isdigit() and (step := self.desk.steps.step(int(before))):
            again = step.arguments[0] == name
            written = [file for file in step.files if file.endswith((".fmu", ".toml"))]
            carried = {"path": written[:1]} if written else step.values
            values = dict(step.values) if again else values | forms.carried(carried, fields)
            place, at = place_of(self.desk.folder, step.files), self._at()
            if place is not None and (at or not again):
                begun_at(place, at, name, fields, values)
        if first := self.get_query_argument("first", ""):
            values[fields[0].name] = [first]
        self._ask(name, fields, values)

    def post(self, name: str) -> None:
        """Begin it, or say what is missing."""
        found, values = self.desk.fields(name), self.form()
        try:
            arguments = forms.arguments(name, found, values)
        except StickslipError as error:
            self._ask(name, found, values, str(error))
            return
        if self.get_query_argument("only", "") == "line":
            self.finish({"line": line(arguments)})
            return
        self.redirect(f"/step/{self.desk.steps.begin(arguments, values)}")

    def _at(self) -> dict[str, float]:
        """Values of a place in a picture, by the names of its axes."""
        names = [name for name in self.request.query_arguments if name.startswith(AT)]
        texts = {name.removeprefix(AT): self.get_query_argument(name) for name in names}
        try:
            return {name: float(text) for name, text in texts.items() if text}
        except ValueError:
            raise StickslipError(f"A place in a picture is given by numbers; found {texts}.") from None

    def _ask(self, name: str, found: list[forms.Field], values: forms.Values, fault: str = "") -> None:
        parts = {"about": self.desk.commands[name], "files": files_of(self.desk.folder), "models": MODELS.names()}
        groups = forms.groups(found, values)
        self.show("give.html", title=name, name=name, groups=groups, values=values, fault=fault, **parts)


class Shown(Page):
    """A step: its command line, what it says, what it wrote, what may come next."""

    def get(self, number: str) -> None:
        """Show it, or how it stands alone."""
        step = self.desk.steps.step(int(number))
        if step is None:
            raise StickslipError(f"There is no step {number}.")
        if self.get_query_argument("only", "") == "state":
            self.finish({"status": step.status, "progress": step.progress, "seconds": step.seconds})
            return
        following = [name for name in forms.NEXT.get(step.arguments[0], ()) if name in self.desk.commands]
        place = place_of(self.desk.folder, step.files) if following else None
        seen = [name for name in step.files if place is None or name != place.picture]
        parts = {
            "pictures": [name for name in seen if name.endswith(PICTURES)],
            "pages": [name for name in seen if name.endswith(".html")],
            "unclickable": place is None and step.arguments[0] in forms.CLICKED,
            "commands": self.desk.commands,
        }
        title = f"{step.arguments[0]}, {step.status}"
        self.show("step.html", title=title, step=step, place=place, following=following, **parts)

    def post(self, number: str) -> None:
        """Stop it."""
        self.desk.steps.stop(int(number))
        self.redirect(f"/step/{number}")


class OneFile(Page):
    """A file of the study."""

    def get(self, name: str) -> None:
        """Send it."""
        path = self.desk.place(name)
        self.set_header("Content-Security-Policy", APART)
        kind = mimetypes.guess_type(path.name)[0] or "application/octet-stream"
        self.set_header("Content-Type", "text/plain; charset=utf-8" if path.suffix == ".toml" else kind)
        self.finish(path.read_bytes())


class Asset(Page):
    """Style and script of the pages."""

    def get(self, name: str) -> None:
        """Send one."""
        self.set_header("Content-Type", "text/css" if name.endswith(".css") else "text/javascript")
        self.finish((Path(__file__).parent / "web" / name).read_bytes())


def serve(desk: Desk, port: int) -> tuple[tornado.httpserver.HTTPServer, str]:
    """Listen on loopback, at a port or, 0, one that is free; the server and the address that lets in. Within a running
    loop. StickslipError: the port is taken."""
    given = {"desk": desk}
    rules = [
        (r"/", Index, given),
        (r"/upload", Upload, given),
        (r"/describe", Describe, given),
        (r"/give/([\w-]+)", Give, given),
        (r"/step/(\d+)", Shown, given),
        (r"/file/(.+)", OneFile, given),
        (r"/(studio\.css|studio\.js)", Asset, given),
    ]
    settings = {"xsrf_cookies": True, "xsrf_cookie_kwargs": {"httponly": True, "samesite": "Strict"}}
    application = tornado.web.Application(rules, default_handler_class=Missing, default_handler_args=given, **settings)  # type: ignore[arg-type]
    try:
        sockets = tornado.netutil.bind_sockets(port, LOOPBACK)
    except OSError as error:
        raise StickslipError(f"Port {port} of this machine cannot be used: {error.strerror}. Name another.") from error
    server = tornado.httpserver.HTTPServer(application, max_body_size=FORM)
    server.add_sockets(sockets)
    return server, f"http://{LOOPBACK}:{sockets[0].getsockname()[1]}/?token={desk.token}"


class Missing(Page):
    """An address that is none."""

    def get(self) -> None:
        """Say so."""
        raise tornado.web.HTTPError(404, reason="There is no such page")
