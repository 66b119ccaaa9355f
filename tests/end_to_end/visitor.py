"""Whoever visits the studio: the command in a process of its own, and a browser without a screen."""

from __future__ import annotations

import html
import http.client
import http.cookiejar
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.parse
import urllib.request
import uuid
from collections.abc import Sequence
from contextlib import closing, suppress
from pathlib import Path

import pytest

from identification.studio.study import CALL

ROOT = Path(__file__).parents[2]
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
        self.xsrf = urllib.parse.unquote(re.findall(r'_xsrf=([^"]+)"', self.get(self.address))[0])

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
        body = f'{entry}"what"\r\n\r\n{what}\r\n'.encode()
        for name, content in files:
            body += f'{entry}"files"; filename="{name}"\r\n\r\n'.encode() + content + b"\r\n"
        kind = {"Content-Type": f"multipart/form-data; boundary={border}"}
        place = f"{self.base}/upload?_xsrf={urllib.parse.quote(self.xsrf)}"
        request = urllib.request.Request(place, body + f"--{border}--\r\n".encode(), kind)
        with self.opener.open(request, timeout=60) as answer:
            return answer.geturl().removeprefix(self.base), answer.read().decode()

    def fault_of(self, what: str, name: str, content: bytes) -> str:
        """What is said of a file that is refused."""
        with pytest.raises(urllib.error.HTTPError, match="404") as refused:
            self.drop(what, [(name, content)])
        with refused.value as answer:
            return html.unescape(answer.read().decode())

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

    def announced(self, size: int, place: str = "/upload", **headers: str) -> bytes:
        """What is answered to the headers of a body that is never sent, until the other side hangs up; b"": it waits
        for the body."""
        host, port = self.base.removeprefix("http://").split(":")
        lines = {"Host": f"{host}:{port}", "Content-Length": str(size), "Content-Type": "multipart/form-data"} | headers
        text = "".join(f"{name}: {value}\r\n" for name, value in lines.items())
        with socket.create_connection((host, int(port)), timeout=5.0) as connection:
            connection.sendall(f"POST {place} HTTP/1.1\r\n{text}\r\n".encode())
            answer = b""
            with suppress(TimeoutError):
                while part := connection.recv(4096):
                    answer += part
            return answer

    def close(self) -> int:
        """Ctrl-C at the terminal; the exit code."""
        self.process.send_signal(signal.SIGINT)
        assert self.process.stdout is not None
        self.process.stdout.close()
        return self.process.wait(60)
