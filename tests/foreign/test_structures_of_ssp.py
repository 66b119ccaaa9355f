"""Systems as SSP structures them: nested, with parameters at every level, mappings, units, dictionaries, all types."""

from __future__ import annotations

import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest
from build import build
from coupled import exported
from models import FOLDER
from structures import SPACES
from test_texts_of_any_fmu import TWO

from fmu_models.base.errors import StickslipError, StickslipWarning
from fmu_models.coupling.points import CommunicationPoints
from fmu_models.coupling.run import CoupledDriver, couple, recorded
from fmu_models.coupling.system import CoupledSystem
from fmu_models.coupling.toml_system import read_system
from fmu_models.importer import text_calls

UNITS = (
    '<ssd:Units><ssc:Unit name="ell"><ssc:BaseUnit m="1" factor="1.143"/></ssc:Unit><ssc:Unit name="m">'
    '<ssc:BaseUnit m="1"/></ssc:Unit><ssc:Unit name="flake"><ssc:BaseUnit kg="1"/></ssc:Unit></ssd:Units>'
)
MASS = 'source="resources/mass.fmu" type="application/x-fmu-sharedlibrary"'
EMPTY = """<?xml version="1.0"?><fmiModelDescription fmiVersion="3.0" modelName="types" instantiationToken="t">
<CoSimulation modelIdentifier="types"/><TypeDefinitions><EnumerationType name="Gear"><Item name="low" value="1"/>
<Item name="high" value="3"/></EnumerationType></TypeDefinitions><ModelVariables>
<Int32 name="teeth" valueReference="1" causality="parameter" variability="fixed" start="7"/>
<Boolean name="on" valueReference="2" causality="parameter" variability="fixed" start="false"/>
<Enumeration name="gear" valueReference="3" declaredType="Gear" causality="parameter" variability="fixed" start="1"/>
<String name="label" valueReference="4" causality="parameter" variability="fixed"><Start value="a"/></String>
</ModelVariables><ModelStructure/></fmiModelDescription>"""


def values(*pairs: str, mapping: str = "", attributes: str = "") -> str:
    """A binding with values, each written 'name Type value [unit]', and entries of a mapping."""
    rows = ""
    for pair in pairs:
        name, kind, value, *unit = pair.split(" ")
        rows += f'<ssv:Parameter name="{name}"><ssv:{kind} value="{value}"'
        rows += "".join(f' unit="{text}"' for text in unit) + "/></ssv:Parameter>"
    held = f'<ssv:ParameterSet version="1.0" name="p"><ssv:Parameters>{rows}</ssv:Parameters></ssv:ParameterSet>'
    if mapping:
        mapping = f'<ssm:ParameterMapping version="1.0">{mapping}</ssm:ParameterMapping>'
        mapping = f"<ssd:ParameterMapping>{mapping}</ssd:ParameterMapping>"
    return (
        f"<ssd:ParameterBinding {attributes}><ssd:ParameterValues>{held}</ssd:ParameterValues>{mapping}"
        "</ssd:ParameterBinding>"
    )


def bound(*bindings: str) -> str:
    return f"<ssd:ParameterBindings>{''.join(bindings)}</ssd:ParameterBindings>"


def connectors(*texts: str) -> str:
    """Connectors, each written 'name kind [Type [unit]]'."""
    rows = ""
    for text in texts:
        name, kind, *typed = text.split(" ")
        unit = f' unit="{typed[1]}"' if len(typed) > 1 else ""
        inner = f"<ssc:{typed[0]}{unit}/>" if typed else ""
        rows += f'<ssd:Connector name="{name}" kind="{kind}">{inner}</ssd:Connector>'
    return f"<ssd:Connectors>{rows}</ssd:Connectors>"


def connected(*texts: str) -> str:
    """Connections, each written 'a.b -> c.d [what is in it]'; the system's own connectors without a dot."""
    rows = ""
    for text in texts:
        start, _, end = text.partition(" -> ")
        end, _, inner = end.partition(" ")
        attributes = ""
        for side, name in (("start", start), ("end", end)):
            element, _, connector = name.rpartition(".")
            attributes += f' {side}Element="{element}"' if element else ""
            attributes += f' {side}Connector="{connector}"'
        if inner == "raw":
            attributes, inner = f'{attributes} suppressUnitConversion="true"', ""
        rows += f"<ssd:Connection{attributes}>{inner}</ssd:Connection>"
    return f"<ssd:Connections>{rows}</ssd:Connections>"


def described(folder: Path, inside: str, *, version: str = "1.0", spaces: str = SPACES, **files: str) -> Path:
    """A description beside the FMU of a mass and other files."""
    (folder / "resources").mkdir(exist_ok=True)
    (folder / "resources/mass.fmu").write_bytes(exported("mass", folder).path.read_bytes())
    for name, text in files.items():
        (folder / name.replace("_", ".")).write_text(text)
    spaces += ' xmlns:ssb="http://ssp-standard.org/SSP1/SystemStructureSignalDictionary"'
    path = folder / "SystemStructure.ssd"
    path.write_text(
        f'<ssd:SystemStructureDescription {spaces} version="{version}" name="s"><ssd:System name="top">{inside}'
        f'</ssd:System>{UNITS}<ssd:DefaultExperiment startTime="0" stopTime="1"/></ssd:SystemStructureDescription>'
    )
    return path


def nested(folder: Path, top: str = "", left: str = "", **more: str) -> Path:
    """Two masses in systems of their own, joined by a signal of a dictionary."""
    dictionary = (
        '<ssb:SignalDictionary version="1.0"><ssb:DictionaryEntry name="place"><ssc:Real unit="cm"/>'
        "</ssb:DictionaryEntry></ssb:SignalDictionary>"
    )
    tap = '<ssd:SignalDictionaryReference name="tap" dictionary="bus">%s</ssd:SignalDictionaryReference>'
    a = f'<ssd:Component name="a" {MASS}>{left}</ssd:Component>{tap % connectors("place input")}'
    b = f'<ssd:Component name="b" {MASS}/>{tap % connectors("place output")}'
    doubled = '<ssc:LinearTransformation factor="2" offset="0.1"/>'
    return described(
        folder,
        connectors("push input Real mm", "stiff parameter Real N/m", "shown output Real ell")
        + bound(values("push Real 25 cm", "stiff Real 0.003 kN/m"), top)
        + "<ssd:Elements>"
        + f'<ssd:System name="left">{connectors("other input Real mm", "stiff parameter Real N/m")}'
        + f"<ssd:Elements>{a}</ssd:Elements>"
        + connected("other -> a.other", "stiff -> a.k", "a.place -> tap.place")
        + f'</ssd:System><ssd:System name="right">{connectors("out output")}<ssd:Elements>{b}</ssd:Elements>'
        + connected(f"tap.place -> b.other {doubled}", "out -> b.place")
        + "</ssd:System></ssd:Elements>"
        + connected("push -> left.other", "stiff -> left.stiff", "right.out -> shown")
        + '<ssd:SignalDictionaries><ssd:SignalDictionary name="bus" source="bus.ssb"/></ssd:SignalDictionaries>',
        bus_ssb=dictionary.replace("<ssb:SignalDictionary", f"<ssb:SignalDictionary {SPACES} {SSB}", 1),
        **more,
    )


SSB = 'xmlns:ssb="http://ssp-standard.org/SSP1/SystemStructureSignalDictionary"'


def test_nested_systems_are_one_with_values_and_units_of_all_levels(tmp_path):
    system = read_system(nested(tmp_path))
    assert list(system.units) == ["left.a", "right.b"]
    assert system.values("inputs") == {"left.a.other": pytest.approx(0.25)}
    assert system.values("parameters") == {"left.a.k": pytest.approx(3.0)}
    (wire,) = system.wires
    assert (wire.source, wire.target) == (("left.a", "place"), ("right.b", "other"))
    # m to cm, back to m, then by the line
    assert (wire.factor, wire.offset) == (pytest.approx(2.0), pytest.approx(0.1))
    assert system.outputs == ("right.b.place",)
    run = couple(system.changed(outputs=("left.a.x", "right.b.place", "right.b.other"), stop_time=2.0))
    # a body of 1 kg between the springs 3 and 2.5 N/m, whose other end is held at .25 m
    rest, rate = 2.5 * 0.25 / 5.5, np.sqrt(5.5)
    assert run["left.a.x"] == pytest.approx(rest * (1 - np.cos(rate * run.time)), abs=1e-7)
    assert run["right.b.other"] == pytest.approx(2 * run["left.a.x"] + 0.1, abs=1e-12)
    assert run["shown"] == pytest.approx(run["right.b.place"] / 1.143, rel=1e-12)
    assert (run.units["shown"], run.units["push"], run["push"][-1]) == ("ell", "mm", pytest.approx(250.0))
    assert run["left.stiff"][0] == pytest.approx(3.0)


def test_values_of_a_higher_level_go_before_and_later_ones_before_earlier(tmp_path):
    lower = bound(values("kc Real 1", "m Real 5"), values("m Real 6"))
    higher = values("a.kc Real 7", attributes='prefix="left."')
    system = read_system(nested(tmp_path, higher, lower))
    assert system.values("parameters") == {"left.a.kc": 7.0, "left.a.m": 6.0, "left.a.k": pytest.approx(3.0)}


def test_what_nothing_takes_is_said_and_left(tmp_path):
    path = nested(tmp_path, values("left.a.kk Real 1", "left.a.k Real 9"))
    with pytest.warns(StickslipWarning) as told:
        system = read_system(path)
    texts = [str(warning.message) for warning in told]
    assert "system 'top' has nothing called 'left.a.kk'" in texts[0]
    assert "'left.a.k' is given a value, but is fed by 'stiff'; the value is not used" in texts[1]
    assert system.values("parameters") == {"left.a.k": pytest.approx(3.0)}


def one(folder: Path, binding: str, **more: str) -> CoupledSystem:
    inside = f'<ssd:Elements><ssd:Component name="a" {MASS}>{bound(binding)}</ssd:Component></ssd:Elements>'
    return read_system(described(folder, inside, **more))


@pytest.mark.parametrize(
    ("given", "inside", "attributes", "value"),
    [
        # units first, then the line
        ("x Real 50 cm", '<ssc:LinearTransformation factor="2" offset="0.25"/>', "", 1.25),
        ("x Real 50 cm", '<ssc:LinearTransformation factor="0.01"/>', 'suppressUnitConversion="true"', 0.5),
        ("x Real 2 ell", "", "", 2.286),
        ("x Real 2 ell", "", 'suppressUnitConversion="true"', 2.0),
        ("x Integer 2", '<ssc:IntegerMappingTransformation><ssc:MapEntry source="2" target="8"/>'
                        "</ssc:IntegerMappingTransformation>", "", 8.0),
        ("x Boolean true", '<ssc:BooleanMappingTransformation><ssc:MapEntry source="true" target="false"/>'
                           "</ssc:BooleanMappingTransformation>", "", 0.0),
    ],
)  # fmt: skip
@pytest.mark.parametrize(("prefix", "source"), [("", "x"), ('prefix="p."', "p.x"), ('prefix="p."', "x")])
def test_mapped_values(tmp_path, given, inside, attributes, value, prefix, source):
    entry = f'<ssm:MappingEntry source="{source}" target="x" {attributes}>{inside}</ssm:MappingEntry>'
    entries = entry + '<ssm:MappingEntry source="x" target="m"/>'.replace('"x"', '"unused"')
    system = one(tmp_path, values(given, mapping=entries, attributes=prefix))
    assert system.values("start") == {"a.x": pytest.approx(value, rel=1e-15)}


def test_a_connection_may_keep_numbers_as_they_are(tmp_path):
    inside = f'<ssd:Elements><ssd:Component name="a" {MASS}/><ssd:Component name="b" {MASS}/></ssd:Elements>'
    line = '<ssc:LinearTransformation factor="2"/>'
    path = described(tmp_path, inside + connected("a.speed -> b.other raw", f"a.other -> b.place {line}"))
    # which end of the second one gives is said by causality; no units meet where only numbers pass
    assert [(w.target[0], w.factor) for w in read_system(path).wires] == [("b", 1.0), ("a", 2.0)]


def test_version_2_with_types_of_fmi_3_and_namespaces_of_its_own(tmp_path):
    system = one(tmp_path, values("x Float64 50 cm"), version="2.0", spaces=SPACES.replace("/SSP1/", "/SSP2/"))
    assert system.values("start") == {"a.x": pytest.approx(0.5)}


def test_a_system_without_components_has_the_values_of_its_connectors(tmp_path):
    inner = f'<ssd:System name="in">{connectors("u input Real", "c parameter Real")}</ssd:System>'
    given = bound(values("u Real 3 mm", "in.c Real 4"))
    path = described(
        tmp_path, connectors("u input Real m", "free input") + given + f"<ssd:Elements>{inner}</ssd:Elements>"
        + connected("u -> in.u"),
    )  # fmt: skip
    system = read_system(path)
    recording = recorded(system, couple(system))
    run = recording.trajectory
    assert {name: values[-1] for name, values in run.values.items()} == {"u": 0.003, "in.u": 0.003, "in.c": 4.0}
    assert run.time[-1] == 1.0 and "values alone" in run.method
    recording.write(tmp_path / "run.h5")


def typed(folder: Path, *given: str, mapping: str = "") -> CoupledSystem:
    with zipfile.ZipFile(folder / "types.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", EMPTY)
    names = ("teeth parameter Integer", "on parameter Boolean", "gear parameter", "label parameter String")
    inside = f'<ssd:Component name="t" source="types.fmu">{connectors(*names)}</ssd:Component>'
    outer = connectors(*names) + bound(values(*given, mapping=mapping)) + f"<ssd:Elements>{inside}</ssd:Elements>"
    return read_system(
        described(folder, outer + connected(*(f"{name.split()[0]} -> t.{name.split()[0]}" for name in names)))
    )


def test_connectors_of_every_type(tmp_path):
    system = typed(tmp_path, "teeth Integer 12", "on Boolean true", "gear Enumeration high", "label String pump")
    assert system.units["t"].parameters == {"teeth": 12.0, "on": 1.0, "gear": 3.0}
    assert system.units["t"].texts == {"label": "pump"}
    assert system.connectors["gear"].value == "high"
    names = '<ssc:MapEntry source="fast" target="high"/><ssc:MapEntry source="slow" target="low"/>'
    names = f"<ssc:EnumerationMappingTransformation>{names}</ssc:EnumerationMappingTransformation>"
    entry = f'<ssm:MappingEntry source="speed" target="gear">{names}</ssm:MappingEntry>'
    assert typed(tmp_path, "speed Enumeration slow", mapping=entry).units["t"].parameters == {"gear": 1.0}
    with pytest.raises(StickslipError, match="has no entry for idle, only for fast, slow"):
        typed(tmp_path, "speed Enumeration idle", mapping=entry)
    with pytest.raises(StickslipError, match=r"'gear' is 'hihg', which 'gear' cannot be\. Did you mean 'high'"):
        typed(tmp_path, "gear Enumeration hihg")
    with pytest.raises(StickslipError, match=r"'teeth' cannot be.* of type Int32"):
        typed(tmp_path, "teeth String many")


def test_texts_reach_the_unit(tmp_path):
    options = ("-DFMI=2", "-Wno-unused-function", "-Wno-unused-variable")
    build(tmp_path / "texts.fmu", FOLDER / "texts.c", TWO, "texts", options=options)
    inside = f'<ssd:Component name="t" source="texts.fmu">{bound(values("label String valve"))}</ssd:Component>'
    system = read_system(described(tmp_path, f"<ssd:Elements>{inside}</ssd:Elements>"))
    # of every run, although a reset takes it away
    driver = CoupledDriver(system)
    with driver:
        for _ in range(2):
            driver.run(0.1)
            assert text_calls.read(driver.composite.instances[0], ["word"]) == {"word": "valve, nothing"}
        with pytest.raises(StickslipError, match=r"Unit 't' has texts \(label\)"):
            driver.batch(0.1, ())
    points = CommunicationPoints(system)
    points.begin(1e-6)
    assert text_calls.read(points.composite.instances[0], ["word"]) == {"word": "valve, nothing"}
    points.composite.close()


TABLE = (
    '<ssc:IntegerMappingTransformation><ssc:MapEntry source="1" target="1"/><ssc:MapEntry source="2" target="4"/>'
    '<ssc:MapEntry source="3" target="9"/></ssc:IntegerMappingTransformation>'
)
MASSES = f'<ssd:Elements><ssd:Component name="a" {MASS}/><ssd:Component name="b" {MASS}/></ssd:Elements>'


@pytest.mark.parametrize(
    ("inside", "said"),
    [
        (MASSES + connected("c.place -> b.other"), "a connection names no element 'c' there"),
        (MASSES + connected("a.place -> b.other", "b.place -> b.other"), "is fed by 'a.place' already, and again by"),
        (MASSES + connected(f"a.place -> b.other {TABLE}"), "maps values by a table that is no line"),
        (MASSES + connected("a.place -> a.k"), "a.place -> a.k is given in m, but is in N/m: these measure different"),
        (MASSES + connected("a.place -> a.k raw"), "'a.k' is a parameter of its unit"),
        (
            MASSES.replace('type="application/x-fmu-sharedlibrary"', 'type="text/x-modelica"'),
            "component 'a' is of type text/x-modelica; FMUs are read",
        ),
        (
            connectors("u input Real ell", "v input Real flake") + bound(values("u Real 1 ell"))
            + "<ssd:Elements>" + f'<ssd:System name="in">{connectors("v input Real flake")}</ssd:System>'
            + "</ssd:Elements>" + connected("u -> in.v"),
            "'u' is given in ell, but is in flake: these measure different quantities",
        ),
        (
            '<ssd:Elements><ssd:SignalDictionaryReference name="tap" dictionary="bus">'
            + connectors("place input") + "</ssd:SignalDictionaryReference></ssd:Elements>",
            "'tap' refers to no signal dictionary 'bus'",
        ),
        (
            "<ssd:Elements>" + "".join(f'<ssd:System name="{n}">{connectors("i input", "o output")}'
            + connected("i -> o") + "</ssd:System>" for n in "ab") + "</ssd:Elements>"
            + connected("a.o -> b.i", "b.o -> a.i"),
            "connections go round",
        ),
        (connectors("u input").replace("kind=", 'type="Real" kind='), "line 1, is not valid SSP 1.0: .* 'type'"),
        (bound(values("u Real 1")).replace('name="u"', 'nme="u"'), "is not valid SSP 1.0: Element 'Parameter'.*'nme'"),
        (
            bound(values("u Real 1", mapping='<ssm:MappingEntry source="u" target="v" to="w"/>')),
            "is not valid SSP 1.0: Element 'MappingEntry'.*'to'",
        ),
        (bound("<ssd:ParameterBinding/>"), "system 'top' has a parameter binding without values"),
    ],
)  # fmt: skip
def test_what_is_wrong_in_a_structure_is_named(tmp_path, inside, said):
    with warnings.catch_warnings(), pytest.raises(StickslipError, match=said):
        warnings.simplefilter("ignore", StickslipWarning)
        read_system(described(tmp_path, inside))
