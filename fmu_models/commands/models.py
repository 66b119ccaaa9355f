"""Command that lists the models."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fmu_models.base import console
from fmu_models.base.registry import OURS
from fmu_models.oscillators import MODELS

if TYPE_CHECKING:
    from fmu_models.language.mechanism import Mechanism


def models(json: console.Json = False) -> None:
    """List the models, by paper.

    Example: stickslip models
    """
    from fmu_models.commands.listing import listed

    rows = listed(MODELS, _row)

    def show(out: console.Console) -> None:
        papers = {
            row["name"]: row["source"].partition(", equation")[0] if row["origin"] == OURS else row["origin"]
            for row in rows
        }
        for paper in dict.fromkeys(papers.values()):
            mine = [row for row in rows if papers[row["name"]] == paper]
            lines = [[row["name"], row["title"], ", ".join(row["contacts"])] for row in mine]
            out.print(console.table(paper, ("model", "what it is", "contacts"), lines))
        out.print("Look at one:  stickslip show MODEL, also of your own: stickslip show my_model.py")

    console.say(json, {"models": rows}, show)


def _row(name: str, model: Mechanism) -> dict[str, Any]:
    return {
        "name": name,
        "title": model.title,
        "contacts": [contact.name for contact in model.contacts],
        "source": model.source,
        "origin": MODELS.origin(name),
    }
