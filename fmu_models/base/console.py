"""How commands talk: a table or JSON on standard output, progress and errors on standard error."""

from __future__ import annotations

import errno
import inspect
import io
import json
import os
import re
import shutil
import sys
import textwrap
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from functools import wraps
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

from fmu_models.base.errors import StickslipError, WriteError
from fmu_models.base.files import FULL
from fmu_models.base.pace import Pace, spoken
from fmu_models.base.plain_options import PlainGroup
from fmu_models.base.printable import in_line, printable, printable_json
from fmu_models.base.table import table as table
from fmu_models.base.trust import command_line, everything

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

# work shorter than this passes without a progress bar, s
PATIENCE = 2.0
UNWRITTEN = 74  # exit code: EX_IOERR of sysexits.h
LINE_EVERY = 10.0  # s between lines of progress where there is no terminal
INTERRUPTED = 130  # exit code: 128 and the number of the signal
# what is copied and pasted, so that no line ends within it: a command behind a colon, an option with its value, quotes
PASTED = re.compile(
    r"""(?<=: )stickslip .+?(?=[.;]?$|[.;] )|(?:--[\w-]+ )?(?<![\w'"`])(['"`])\S.*?\1(?!\w)|--[\w-]+ \S+"""
)
# what stays on a line of an example, which is longer than one: an option with its value, quotes
OPTION = re.compile(r"""(?<!\S)--?[a-z][\w-]*(?: (?:'[^']*'|"[^"]*"|[^-\s'"]\S*))?|'[^']*'|"[^"]*\"""")
UNBROKEN = "\0"  # a blank in it; `printable` leaves none in a text

Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace files that exist.")]
Trust = Annotated[
    bool, typer.Option("--trust", help="Run the Python files, and the FMUs elsewhere, that a file given here names.")
]
Settings = Annotated[
    list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="Parameter in SI units; repeat for several.")
]
Inputs = Annotated[
    list[str] | None,
    typer.Option(
        "--input",
        metavar="NAME=VALUE|LOG:COLUMN",
        help="Input: a constant, or a column of a log (speed.csv:w), its unit converted; repeat for several.",
    ),
]
Contacts = Annotated[
    str | None,
    typer.Option(metavar="NAMES", help="Contacts to keep, separated by commas; 'none' for a free body (default: all)."),
]


def app(help_text: str, *, no_args_is_help: bool = True, completion: bool = False) -> typer.Typer:
    """A group of commands in the common style; ``completion`` adds the options that set it up in a shell."""
    return typer.Typer(
        cls=PlainGroup,
        help=help_text,
        no_args_is_help=no_args_is_help,
        rich_markup_mode="rich",
        add_completion=completion,
        context_settings={"help_option_names": ["-h", "--help"]},
    )


def flowing(command: Callable[..., None]) -> str:
    """The help of a command from its docstring: typer breaks lines of all paragraphs but the first where we do, which
    is between options in examples."""
    texts = (text.replace("\n", " ") for text in inspect.cleandoc(command.__doc__ or "").split("\n\n"))
    width = shutil.get_terminal_size().columns - 2
    return "\n\n".join(hanging(text, width, whole=OPTION) if text.startswith("Example:") else text for text in texts)


def trusting(command: Callable[..., None]) -> Callable[..., None]:
    """The command with ``--trust``: one that reads documents which may name code, see `trust`."""

    @wraps(command)
    def run(*, trust: bool = False, **arguments: Any) -> None:
        with everything() if trust else nullcontext():
            command(**arguments)

    hints = get_type_hints(command, include_extras=True)
    parameters = [
        parameter.replace(annotation=hints[name], kind=inspect.Parameter.KEYWORD_ONLY)
        for name, parameter in inspect.signature(command).parameters.items()
    ]
    added = inspect.Parameter("trust", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=Trust)
    run.__signature__ = inspect.Signature([*parameters, added])  # type: ignore[attr-defined] # what typer reads
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in (*parameters, added)}
    return run


def interactive() -> bool:
    """Whether somebody can answer a question: the input is a terminal, but not that which a notebook gives to its `!`
    commands (its kernel has `JPY_PARENT_PID` in the environment), into which nobody can type."""
    return sys.stdin is not None and sys.stdin.isatty() and "JPY_PARENT_PID" not in os.environ


def console() -> Console:
    """The console on which results are printed for people."""
    from fmu_models.base.printable_console import PrintableConsole

    printer = PrintableConsole(highlight=False, emoji=False)
    if not printer.is_terminal and "COLUMNS" not in os.environ:
        printer.width = 120  # a file or a pipe has no width of its own
    return printer


def say(as_json: bool, data: Mapping[str, Any], show: Callable[[Console], None]) -> None:
    """Print a result: ``data`` as JSON, or what ``show`` prints for people."""
    if as_json:
        print(printable_json(json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False)))
    else:
        show(console())


def plain(text: str, style: str = "") -> Text:
    """Text of somebody else: shown as it is, brackets no markup and control characters no commands to the terminal."""
    from rich.text import Text

    return Text(in_line(text), style=style)


@contextmanager
def progress(label: str) -> Iterator[Callable[[float], None]]:
    """Yield a function to call with the fraction done. On a terminal a bar appears once the work has taken two seconds;
    elsewhere there is a line on standard error every ten seconds. Notes of an interrupt are said."""
    pace, start = Pace(), time.monotonic()
    try:
        with _bar(label) if sys.stderr.isatty() else _lines(label) as show:

            def advance(fraction: float) -> None:
                elapsed = time.monotonic() - start
                remaining = pace.remaining(elapsed, fraction)
                show(elapsed, fraction, "" if remaining is None else f"about {spoken(remaining)} left")

            yield advance
    except KeyboardInterrupt as interrupt:
        for note in getattr(interrupt, "__notes__", ()):
            _complain(note)
        raise


@contextmanager
def _bar(label: str) -> Iterator[Callable[[float, float, str], None]]:
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

    from fmu_models.base.printable_console import PrintableConsole

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TextColumn("{task.fields[left]}"))
    bar = Progress(*columns, console=PrintableConsole(stderr=True), transient=True)
    task = bar.add_task(label, total=1.0, left="")

    def show(elapsed: float, fraction: float, remaining: str) -> None:
        if elapsed > PATIENCE:
            bar.start()
            bar.update(task, completed=fraction, left=remaining)

    try:
        yield show
    finally:
        bar.stop()


@contextmanager
def _lines(label: str) -> Iterator[Callable[[float, float, str], None]]:
    due = LINE_EVERY

    def show(elapsed: float, fraction: float, remaining: str) -> None:
        nonlocal due
        if elapsed >= due:
            due = elapsed + LINE_EVERY
            _complain(", ".join(text for text in (f"{label}: {fraction:.0%}", remaining) if text))

    yield show


@contextmanager
def output_of_libraries() -> Iterator[None]:
    """Send to standard error what the C code of an FMU prints meanwhile: standard output is for results."""
    import ctypes

    sys.stdout.flush()
    saved = os.dup(1)
    os.dup2(2, 1)
    try:
        yield
    finally:
        if os.name == "posix":
            # what it printed may still wait in a buffer of the C library
            ctypes.CDLL(None).fflush(None)
        os.dup2(saved, 1)
        os.close(saved)


def assignments(texts: Sequence[str] | None, kind: str) -> dict[str, float]:
    """Numbers from arguments ``NAME=VALUE``; errors as for ``settings``."""
    return {name: float(value) for name, value in settings(texts, kind).items()}


def settings(
    texts: Sequence[str] | None, kind: str, is_text: Callable[[str], bool] = lambda _: False, columns: bool = False
) -> dict[str, float | str]:
    """Numbers from arguments ``NAME=VALUE``, and texts for the names of which ``is_text`` says so; where ``columns``
    also columns ``LOG:COLUMN`` of logs, as texts. StickslipError: not of that form, not a number, or a name twice."""
    values: dict[str, float | str] = {}
    for text in texts or ():
        name, equals, value = text.partition("=")
        name = name.strip()
        try:
            number = value if is_text(name) or (columns and ":" in value) else float(value)
        except ValueError:
            equals = ""
            number = 0.0
        if not equals or not name:
            article, column = ("An", ", or NAME=LOG:COLUMN from a log") if columns else ("A", "")
            raise StickslipError(
                f"{article} {kind} is given as NAME=VALUE with a number, for example J=0.05{column}; found '{text}'."
            )
        if name in values:
            raise StickslipError(f"The {kind} '{name}' is given twice. Give it once.")
        values[name] = number
    return values


def pairs(texts: Sequence[str] | None, option: str, form: str, between: str = "=") -> list[tuple[str, str]]:
    """Both sides of arguments ``NAME=SOMETHING``. StickslipError: not of that ``form``, in words with an example."""
    parted = [text.partition(between) for text in texts or ()]
    for name, sign, value in parted:
        if not (name.strip() and sign and value.strip()):
            raise StickslipError(f"{option} takes {form}; found '{name}{sign}{value}'.")
    return [(name.strip(), value.strip()) for name, _, value in parted]


def spans(texts: Sequence[str] | None, option: str) -> dict[str, tuple[float, float]]:
    """Two ascending numbers by name, from arguments ``NAME=LOW:HIGH``; errors as for ``pairs``."""
    ends = {}
    for name, text in pairs(texts, option, "NAME=LOW:HIGH, such as y=0:10"):
        try:
            low, high = (float(end) for end in text.split(":"))
        except ValueError:
            low, high = 0.0, 0.0
        if not low < high:
            raise StickslipError(f"{option} takes NAME=LOW:HIGH with two ascending numbers; found '{name}={text}'.")
        ends[name] = low, high
    return ends


def numbers(text: str, option: str) -> list[float]:
    """Numbers between commas. StickslipError: others."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError as error:
        raise StickslipError(
            f"{option} takes numbers separated by commas, such as 0.2,0.41; found '{text}'."
        ) from error


def chosen(contacts: str | None) -> tuple[str, ...] | None:
    """Names from ``--contacts``; None for all."""
    if contacts is None:
        return None
    return () if contacts.strip() == "none" else tuple(names_of(contacts))


def names_of(text: str | None) -> list[str]:
    """Names between commas; none without a text."""
    return [name.strip() for name in (text or "").split(",") if name.strip()]


def print_files(files: Iterable[object], out: Console) -> None:
    """Name the files written."""
    for path in files:
        out.print(plain(f"written: {path}"))


def run(application: typer.Typer) -> None:
    """Run a command line: errors of the user exit with 2, a disk that is full with 74, an interrupt with 130."""
    # typer brings its own click, whose errors it does not export; their base class is that of one it does
    usage_error: Any = next(kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "ClickException")
    try:
        with command_line(sys.argv[1:]):
            code = application(standalone_mode=False)
        sys.stdout.flush()
    except StickslipError as error:
        _complain(str(error))
        code = UNWRITTEN if isinstance(error, WriteError) else 2
    except OSError as error:
        if error.errno == errno.ENAMETOOLONG:
            _complain(f"There is no file of that name: {error.strerror}. Found '{str(error.filename)[:60]}...'.")
            sys.exit(2)
        if error.errno not in FULL:
            raise
        name = f"'{error.filename}'" if error.filename else "the output"
        _complain(f"{name} cannot be written: {error.strerror}.")
        code = UNWRITTEN
        _forget_output()
    except usage_error as error:
        error.message = printable(error.message)
        usage = io.StringIO()
        error.show(usage)
        _print_error(usage.getvalue().removesuffix("\n"))
        code = 2
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED
    if code == INTERRUPTED:
        # typer turns an interrupt into this code without a word
        _complain("interrupted; what was finished is kept.")
    sys.exit(code if isinstance(code, int) else 0)


def _forget_output() -> None:
    """What still waits for standard output goes nowhere: Python would try once more at its end, and complain."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.close(nowhere)


@contextmanager
def warnings_said() -> Iterator[None]:
    """Say on standard error, at the end, each warning of the work once."""
    with warnings.catch_warnings(record=True) as recorded:
        warnings.simplefilter("always")
        try:
            yield
        finally:
            for text in dict.fromkeys(str(warning.message) for warning in recorded):
                warn(text)


def warn(text: str) -> None:
    """Say on standard error what does not stop the work."""
    _complain(f"warning: {text}")


def _complain(text: str) -> None:
    _print_error(f"stickslip: {printable(text)}")


def _print_error(text: str) -> None:
    # a terminal itself would break lines within words; one of a notebook has no width
    if sys.stderr.isatty() and (width := os.get_terminal_size(sys.stderr.fileno()).columns):
        text = "\n".join(hanging(line, width) for line in text.split("\n"))
    print(text, file=sys.stderr)


def hanging(text: str, width: int, indent: int = 0, whole: re.Pattern[str] = PASTED) -> str:
    """A line broken between words, but not within what is ``whole``, with what goes on below it indented."""
    return textwrap.fill(
        whole.sub(lambda match: match[0].replace(" ", UNBROKEN), text),
        max(width, indent + 1),
        subsequent_indent=" " * indent,
        break_long_words=False,
        break_on_hyphens=False,
    ).replace(UNBROKEN, " ")
