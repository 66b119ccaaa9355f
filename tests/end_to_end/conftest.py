"""The command line as a user meets it."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator

import pytest
from firefox import FIREFOX, Tab, firefox

from identification import cli


class Answer:
    """What a command did: exit code, standard output and standard error."""

    def __init__(self, code: int, out: str, err: str) -> None:
        self.code, self.out, self.err = code, out, err

    @property
    def json(self) -> dict:
        return json.loads(self.out)


@pytest.fixture
def stickslip(monkeypatch, capsys, tmp_path):
    """Run the command in an empty folder, in this process."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> Answer:
        monkeypatch.setattr(sys, "argv", ["stickslip", *(str(argument) for argument in arguments)])
        with pytest.raises(SystemExit) as stopped:
            cli.main()
        printed = capsys.readouterr()
        return Answer(int(stopped.value.code or 0), printed.out, printed.err)

    return run


@pytest.fixture(scope="module")
def firefox_tab() -> Iterator[Tab]:
    """A tab of the system's Firefox; a test is skipped where it, or what leads it, is absent.

    No page that is opened in it complains, or asks the network for anything.
    """
    websockets = pytest.importorskip("websockets.sync.client", reason="websockets, which leads Firefox, is missing")
    if FIREFOX is None:
        pytest.skip("no Firefox is installed, in which the page could be opened")
    with firefox(websockets.connect) as made:
        yield made
        assert made.complaints == []
        assert {one.partition(":")[0] for one in made.requests} <= {"file", "data", "blob"}
