"""A command on a pseudo-terminal, and somebody who answers its questions."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
import time
from collections.abc import Callable, Sequence

PROMPT = re.compile(r"\n([^\n]*\S[^\n]*)\r?\n\s*\[[^\n]*\] > $")
PATIENCE = 60.0  # s


def talk(arguments: Sequence[object], answer: Callable[[str], str]) -> tuple[int, list[str], str]:
    """Run `stickslip` on a terminal of 200 columns; exit code, the questions it asked, and all that was shown.

    answer: to a question, as it is shown.
    """
    ours, theirs = pty.openpty()
    environment = {**os.environ, "COLUMNS": "200", "TERM": "dumb"}
    command = [sys.executable, "-c", "from identification.cli import main; main()", *map(str, arguments)]
    process = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, env=environment)
    os.close(theirs)
    shown, seen, asked = "", 0, []
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        try:
            piece = os.read(ours, 65536).decode("utf-8", "replace")
        except OSError:  # the terminal is closed on the other side
            break
        if not piece:
            break
        shown += piece
        found = PROMPT.search(shown[seen:])
        if found:
            asked.append(found[1].strip())
            assert asked.count(asked[-1]) < 5, f"asked again and again: {shown[-1000:]!r}"
            seen = len(shown)
            os.write(ours, (answer(found[1].strip()) + "\n").encode())
    if time.monotonic() >= end:
        process.kill()
        raise TimeoutError(f"it waits, having shown: {shown[-2000:]!r}")
    code = process.wait(timeout=10)
    os.close(ours)
    return code, asked, shown


def by_table(answers: dict[str, str]) -> Callable[[str], str]:
    """Answers by the words that a question begins with, or holds."""

    def answer(question: str) -> str:
        return next(
            (said for words, said in answers.items() if question.startswith(words) or words in question[4:]), ""
        )

    return answer
