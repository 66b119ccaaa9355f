"""The Firefox of the system, headless, by the standard that it speaks itself: WebDriver BiDi.

Playwright drives only a Firefox of its own, which its own servers must be reached for.
"""

from __future__ import annotations

import base64
import io
import json
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.image import imread
from numpy.typing import NDArray

FIREFOX = shutil.which("firefox-esr") or shutil.which("firefox")
KEYS = {"Enter": "\ue006", "End": "\ue010", "ArrowRight": "\ue014"}  # as the standard numbers them
PATIENCE = 60.0  # s


class Tab:
    """A tab, what it asked for and what it complained of."""

    def __init__(self, socket: Any) -> None:
        self._socket, self._sent = socket, 0
        self.requests: list[str] = []
        self.complaints: list[str] = []
        self._send("session.new", capabilities={})
        self._send("session.subscribe", events=["log.entryAdded", "network.beforeRequestSent"])
        self._page = self._context = self._tree()["context"]

    def _send(self, method: str, **params: Any) -> Any:
        self._sent += 1
        self._socket.send(json.dumps({"id": self._sent, "method": method, "params": params}))
        while True:
            answer = json.loads(self._socket.recv(timeout=PATIENCE))
            if answer["type"] == "event":
                self._hear(answer["method"], answer["params"])
            elif answer["id"] == self._sent:
                assert answer["type"] == "success", answer
                return answer["result"]

    def _hear(self, event: str, told: Any) -> None:
        if event == "log.entryAdded":
            self.complaints.append(told["text"])
        else:
            self.requests.append(told["request"]["url"])

    def _tree(self) -> Any:
        """The page, and under ``children`` its frames."""
        return self._send("browsingContext.getTree")["contexts"][0]

    def resize(self, width: int) -> None:
        self._send("browsingContext.setViewport", context=self._page, viewport={"width": width, "height": 900})

    def open(self, address: str) -> None:
        """Afresh, also where only what follows the # differs from before."""
        self._context = self._page
        for url in ("about:blank", address):
            self._send("browsingContext.navigate", context=self._page, url=url, wait="complete")

    def enter(self) -> None:
        """The only frame of the page: what follows is asked of it and done in it, until a page is opened."""
        (frame,) = self._tree()["children"]
        self._context = frame["context"]

    def evaluate(self, expression: str) -> Any:
        """What JSON can hold of a value, or of what is promised."""
        text = f"(async () => JSON.stringify(await ({expression}) ?? null))()"
        target = {"context": self._context}
        found = self._send("script.evaluate", expression=text, target=target, awaitPromise=True)
        assert found["type"] == "success", found
        return json.loads(found["result"]["value"])

    def wait(self, condition: str) -> None:
        """Until an expression is true."""
        self.evaluate(
            f"""new Promise((done, failed) => {{
              const until = performance.now() + {1000 * PATIENCE / 2};
              const look = () => ({condition}) ? done(true) : performance.now() > until ? failed(new Error("late"))
                : setTimeout(look, 20);
              look();
            }})"""
        )

    def press(self, *keys: str) -> None:
        """Of the element that has the focus: names of ``KEYS``, or text."""
        typed = [one for key in keys for one in KEYS.get(key, key)]
        actions = [{"type": kind, "value": key} for key in typed for kind in ("keyDown", "keyUp")]
        self._act({"type": "key", "id": "keyboard", "actions": actions})

    def click(self, selector: str) -> None:
        """With the mouse: a Firefox without a window takes no key for a click."""
        middle = self.evaluate(
            f"((one) => (one.scrollIntoView(), (({{x, y, width, height}}) => [x + width / 2, y + height / 2])"
            f"(one.getBoundingClientRect())))(document.querySelector('{selector}'))"
        )
        x, y = (round(place) for place in middle)
        pressed = [{"type": kind, "button": 0} for kind in ("pointerDown", "pointerUp")]
        actions = [{"type": "pointerMove", "x": x, "y": y}, *pressed]
        self._act({"type": "pointer", "id": "mouse", "actions": actions})

    def give(self, selector: str, *files: Path) -> None:
        """Files to an input."""
        locator = {"type": "css", "value": selector}
        (element,) = self._send("browsingContext.locateNodes", context=self._context, locator=locator)["nodes"]
        names = [str(file) for file in files]
        self._send("input.setFiles", context=self._context, element={"sharedId": element["sharedId"]}, files=names)

    def _act(self, source: dict[str, Any]) -> None:
        self._send("input.performActions", context=self._context, actions=[source])

    def seen(self, selector: str) -> NDArray[np.float64]:
        """Picture of an element, (height, width, 3), 0 to 1."""
        box = self.evaluate(
            f"(({{x, y, width, height}}) => ({{x: x + scrollX, y: y + scrollY, width, height}}))"
            f"(document.querySelector('{selector}').getBoundingClientRect())"
        )
        clip = {"type": "box", **box}
        shot = self._send("browsingContext.captureScreenshot", context=self._context, origin="document", clip=clip)
        return np.asarray(imread(io.BytesIO(base64.b64decode(shot["data"])), "png"), float)[:, :, :3]


@contextmanager
def firefox(connect: Callable[..., Any]) -> Iterator[Tab]:
    """Firefox with an empty profile; it is ended with the block. connect: of a web socket, to an address."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [str(FIREFOX), "--headless", "--no-remote", "--profile", profile, "--remote-debugging-port", "0"]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
            try:
                assert process.stderr is not None
                said = (re.search(r"BiDi listening on (ws://\S+)", line) for line in process.stderr)
                address = next(found[1] for found in said if found)
                with connect(f"{address}/session", max_size=None) as socket:
                    yield Tab(socket)
            finally:
                process.terminate()
