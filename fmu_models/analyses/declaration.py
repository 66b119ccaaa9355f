"""An analysis of a family of motions, declared once: its function, whose annotated parameters are its options.

The command of the shell, the kind of a scene and their rows in the manual are derived from it. A
parameter ``name: Annotated[type, Option(...)] = default`` is an option; ``system``, ``start`` and ``progress`` are what
every analysis has, ``execution`` says that its runs can be kept, and the axes are what is left. A file of this
folder is an analysis if it sets ``ANALYSIS``; its name is that of the command and of the kind.
"""

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_origin, get_type_hints

from fmu_models.base.registry import Registry
from fmu_models.base.shown import Pictured

if TYPE_CHECKING:
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.sections.system import SectionSystem

# what the axes of an analysis may be
VALUES, RANGE, PARAMETERS, STATE, STATES = "values", "range", "parameters", "one state", "states"
CROSSED = ("level", "down", "impacts", "returns", "accept", "cap")  # options of sections that a motion crosses
WATCHED = ("autonomous", *CROSSED)  # and that nothing forces the motion, which `labels.watched` sees by itself
SECTION, OSCILLATOR, EITHER = "section", "oscillator", "either"  # what an analysis may be of

SHOWN = "What is drawn: a state, or a quantity of a period, as max(x), mean(OUTPUT), impact_speed(CONTACT)."

Range = tuple[str, float, float]  # a parameter, its least and its largest value
Numbers = Mapping[str, float]  # of states by name
Box = Mapping[str, tuple[float, float]]  # ranges of states by name, or what an input moves between
NO_NUMBERS: Numbers = MappingProxyType({})  # their defaults, which are told apart
NO_BOX: Box = MappingProxyType({})
NO_RAMP: Box = MappingProxyType({})


@dataclass(frozen=True)
class Option:
    """What an option means.

    Attributes:
        help: in a sentence.
        minimum: the least value that is sensible; None if there is none.
        flag: its name in the shell, where the parameter's own will not do.
        default: in words, where the value of the parameter says nothing.
        metavar: what stands for its value in the shell.
        words: of the shell for False and True.
        in_scene: the default of a scene, where it is another one.
        scene: whether a scene has it, as it has all but parameters with a range.
        constants: whether it reads names that a scene's model has no more: the argument that takes their values.
    """

    help: str
    minimum: int | None = None
    flag: str | None = None
    default: str | None = None
    metavar: str | None = None
    words: tuple[str, str] | None = None
    in_scene: Any = None
    scene: bool = True
    constants: str | None = None


@dataclass(frozen=True)
class Declared:
    """An option with the parameter that it belongs to."""

    name: str
    type: Any
    default: Any
    option: Option

    @property
    def range(self) -> bool:
        """Whether it is a parameter with its range, which the shell alone takes."""
        return Range in (self.type, *get_args(self.type))

    @property
    def by_name(self) -> bool:
        """Whether it is numbers or ranges of states, by name."""
        return self.type in (Numbers, Box)

    @property
    def in_scene(self) -> Any:
        """The default in a scene, where False and True are 0 and 1."""
        default = self.default if self.option.in_scene is None else self.option.in_scene
        return int(default) if isinstance(default, bool) else default


@dataclass(frozen=True, kw_only=True)
class Analysis:
    """An analysis.

    Attributes:
        function: from what it is of to the result; its docstring begins with the help of the command.
        numbers: from the result to what a scene compares by name: for all of it, or a pair (value, numbers) for each
            value of what is varied. Over a RANGE it takes the values of the scene too.
        results: names of these numbers, for the manual.
        example: arguments of the command.
        label: of the progress bar.
        axes: VALUES of one parameter, its RANGE, two PARAMETERS, values of one STATE or of several STATES, or "".
        subject: a SECTION system, an OSCILLATOR with values of its ``parameters``, or EITHER.
        without: options of a section that the analysis does not take.
        forced: It needs the period of a forcing.
        page: whether a click in its interactive page runs a motion.
        of_run: settings of a scene's run of so many periods; then the section is a strobe.
    """

    function: Callable[..., Pictured]
    numbers: Callable[..., Numbers | Sequence[tuple[float, Numbers]]]
    results: str
    example: str
    label: str
    axes: str = ""
    subject: str = SECTION
    without: tuple[str, ...] = ()
    forced: bool = False
    page: bool = True
    of_run: Callable[[int], dict[str, int]] | None = None

    @cached_property
    def options(self) -> Mapping[str, Declared]:
        """Options by the names of their parameters."""
        return {declared.name: declared for declared in self._declared()}

    @cached_property
    def stores(self) -> bool:
        """Whether its runs can be kept and made elsewhere: its function takes an ``execution``."""
        return "execution" in inspect.signature(self.function).parameters

    @property
    def sweeps(self) -> bool:
        """Whether it is over values of one parameter."""
        return self.axes in (VALUES, RANGE)

    @property
    def summary(self) -> str:
        """The analysis in a sentence: the first paragraph of the function's docstring."""
        return " ".join(inspect.cleandoc(self.function.__doc__ or "").split("\n\n")[0].split())

    def run(self, subject: "SectionSystem | Fmu", axes: Mapping[str, Any], **arguments: Any) -> Pictured:
        """The result over axes by name; ``progress`` and ``start`` are left out where the function takes none."""
        for name in {"progress", "start"} - set(inspect.signature(self.function).parameters):
            arguments.pop(name, None)
        if not self.sweeps and self.axes != STATE:
            return self.function(subject, **arguments, **axes)
        ((over, values),) = axes.items()
        return self.function(subject, over, values, **arguments)

    def _declared(self) -> Iterator[Declared]:
        hints = get_type_hints(self.function, include_extras=True)
        for name, parameter in inspect.signature(self.function).parameters.items():
            hint = hints.get(name)
            kind, *notes = get_args(hint) if get_origin(hint) is Annotated else (hint,)
            for option in notes:
                if isinstance(option, Option):
                    yield Declared(name, kind, parameter.default, option)


ANALYSES: Registry[Analysis] = Registry(
    kind="analysis",
    package=__name__.rpartition(".")[0],
    attribute="ANALYSIS",
    group="stickslip.analyses",
    types=(f"{__name__}.Analysis",),
)
