"""A console of rich on which nothing that is printed is a command to the terminal, but rich's own."""

from collections.abc import Iterable

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from fmu_models.base.printable import printable


class PrintableConsole(Console):
    """Texts are escaped where they become segments, after all markup and before all styles: none gets past."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Render as rich does."""
        for segment in super().render(renderable, options):
            if segment.control or segment.text.isprintable():
                yield segment
            else:
                yield Segment(printable(segment.text), segment.style)
