"""What an FMU holds for people: the page says what the model says, pictures and terminals are valid."""

from __future__ import annotations

import html
import io
import re
from pathlib import Path

import fmpy
import pytest
from lxml import etree  # type: ignore[attr-defined]  # compiled, without types
from PIL import Image

from fmu_models.codegen.documentation import documents
from fmu_models.codegen.model_structure import ModelStructure
from fmu_models.codegen.package import variant
from fmu_models.codegen.rights import Rights
from fmu_models.lowering.lower import lower
from fmu_models.oscillators import MODELS

TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"
SCHEMA = etree.XMLSchema(etree.parse(Path(fmpy.__file__).parent / "schema/fmi3/fmi3TerminalsAndIcons.xsd"))


def made(model: str, version: str = "3.0") -> dict[str, bytes | str]:
    return documents(ModelStructure(lower(variant(model))), version, "{token}", "stickslip", Rights(author="A. Author"))


@pytest.fixture(scope="module", params=MODELS.members())
def files(request: pytest.FixtureRequest) -> tuple[str, dict[str, bytes | str]]:
    return request.param, made(request.param)


def test_terminals_are_valid_and_name_variables_and_icons_that_are_there(files) -> None:
    model, found = files
    root = etree.fromstring(str(found[TERMINALS]).encode())
    SCHEMA.assertValid(root.getroottree())
    listed = {v.name for v in ModelStructure(lower(variant(model))).variables.listed}
    assert {m.get("variableName") for m in root.iter("TerminalMemberVariable")} <= listed
    icons = {g.get("iconBaseName") for g in root.iter("TerminalGraphicalRepresentation")} | {"icon"}
    assert {f"terminalsAndIcons/{name}.png" for name in icons} <= set(found)


def test_the_page_is_well_formed_and_needs_no_network(files) -> None:
    model, found = files
    page = str(found["documentation/index.html"])
    whole = re.sub(r"<meta[^>]*>|<img[^>]*>", "", page.replace("<!DOCTYPE html>", ""))
    root = etree.fromstring(html.unescape(whole.replace("&lt;", "\u2039").replace("&amp;", "+")).encode())
    system = lower(variant(model))
    rows = {"".join(row[0].itertext()): row for row in root.iter("tr") if len(row)}
    assert {p.name for p in system.parameters} | {o.name for o in system.outputs} <= rows.keys()
    assert {h.text.partition(":")[0] for h in root.iter("h3")} == {contact.name for contact in system.contacts}
    assert len(list(root.iter("mover"))) >= len(system.states)
    assert not re.search(r"(src|href)=\"(?!\.\./|licenses/)", page) and "http" not in page
    assert "A. Author" in page and "licenses/license.txt" in page and "SymPy" in page


def test_equations_are_the_declared_ones() -> None:
    """Of the block on a belt: v' = (force - k x - c v) / m, read back from the markup as text in the order of marks."""
    page = str(made("block_on_belt")["documentation/index.html"])
    row = next(r for r in re.findall(r"<tr><th><math><mover><mi>v</mi>.*?</tr>", page))
    marks = re.findall(r"<m[ino]>([^<]*)</m[ino]>", row)
    assert {"v", "x", "k", "c", "m"} <= set(marks) and "&#955;" in marks
    assert "<mfrac>" in row
    dissipated = next(r for r in re.findall(r"<tr><th>power_dissipated</th>.*?</tr>", page))
    assert "<msup><mi>v</mi><mn>2</mn></msup>" in dissipated


def test_pictures_can_be_read_and_stand_where_the_version_looks_for_them() -> None:
    two, three = made("disc_rig", "2.0"), made("disc_rig")
    assert "model.png" in two and "model.png" not in three
    # terminals came with FMI 3.0
    assert not any(name.startswith("terminalsAndIcons") for name in two) and TERMINALS in three
    sizes = []
    for name, data in {**two, **three}.items():
        if name.endswith(".png"):
            assert isinstance(data, bytes)
            with Image.open(io.BytesIO(data)) as picture:
                picture.load()
                sizes.append(picture.size)
                assert picture.format == "PNG" and len(set(picture.convert("L").tobytes())) == 2
    assert (16, 16) in sizes and max(sizes) > (150, 100)
