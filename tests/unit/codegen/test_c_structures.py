"""Structures and constants read from the C headers are those of the compiler; what is not read is refused."""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Any

import pytest

from fmu_models.codegen import c_structures
from fmu_models.codegen.c_source import sources
from fmu_models.codegen.c_structures import Declarations
from fmu_models.coupling import composite
from fmu_models.importer import instance
from fmu_models.language import contact_kinds
from fmu_models.lowering.lower import lower
from fmu_models.oscillators import load
from fmu_models.simulation import engine
from fmu_models.toolchain.compiler import compile_shared, engine_sources

IMPORTER = Path(c_structures.__file__).parents[1] / "importer" / "c"
ENUMERATIONS = {
    "engine/model/model.h": ("Slot",),
    "engine/model/run_state.h": ("RunStatus",),
    "importer/c/master.h": ("Function", "Type", "MethodChoice", "EventKind", "RunStatus"),
}


def mirrored() -> list[tuple[str, Any]]:
    """Every structure that Python reads, with the header that holds it."""
    return [
        *(
            ("whole_run/sensitivity_run.h", engine.C.structure(name))
            for name in ("RunStart", "WholeRun", "SensitivityRun", "ContactEvent")
        ),
        ("ensemble/request.h", engine.C.structure("Ensemble")),
        *(("fmi_calls.h", s) for s in (instance.Log, instance.FmuInstance, instance.Variables, instance.Run)),
        *(("fmi_calls.h", s) for s in (instance.Update, instance.Stepped, instance._C.structure("MasterEvent"))),
        *(("exchange.h", composite._C.structure(name)) for name in ("Group", "Stage", "Coupling")),
    ]


def header_sources(header: str) -> dict[str, str]:
    """The files that a program with this header needs."""
    if "/" not in header:
        return {path.name: path.read_text("utf-8") for path in IMPORTER.glob("*.h")}
    headers = {name: text for name, text in engine_sources().items() if name.endswith(".h")}
    return headers | sources(lower(load("block_on_belt")))


def compiled(header: str, expressions: list[str], folder: Path) -> list[int]:
    """What the compiler says that constant expressions are, with a header included."""
    values = ", ".join(f"(long long)({e})" for e in expressions)
    text = (
        f'#include "{header}"\n#include <stddef.h>\n'
        f'__attribute__((visibility("default"))) const long long answers[] = {{{values}}};\n'
    )
    library = compile_shared({**header_sources(header), "all.c": text}, folder / "library")
    return list((ctypes.c_longlong * len(expressions)).in_dll(ctypes.CDLL(str(library)), "answers"))


@pytest.mark.parametrize(("header", "structure"), mirrored(), ids=lambda x: getattr(x, "__name__", None))
def test_sizes_and_offsets_are_those_of_the_compiler(header: str, structure: Any, tmp_path: Path) -> None:
    name, fields = structure.__name__, [field for field, _ in structure._fields_]
    asked = [f"sizeof({name})", *(f"offsetof({name}, {f})" for f in fields)]
    asked += [f"sizeof((({name} *)0)->{f})" for f in fields]
    places = [getattr(structure, f) for f in fields]
    here = [ctypes.sizeof(structure), *(p.offset for p in places), *(p.size for p in places)]
    assert compiled(header, asked, tmp_path) == here


@pytest.mark.parametrize("header", ENUMERATIONS)
def test_constants_are_those_of_the_compiler(header: str, tmp_path: Path) -> None:
    read = Declarations(header)
    found = {n: v for name in ENUMERATIONS[header] for n, v in vars(read.constants(name)).items()}
    assert len(found) > 1
    assert compiled(header.removeprefix("engine/").removeprefix("importer/c/"), list(found), tmp_path) == [
        *found.values()
    ]


def test_every_state_of_a_contact_has_its_words() -> None:
    assert sorted(contact_kinds.STATES.values()) == sorted(contact_kinds.CONTACT_STATES)
    kinds = contact_kinds.KINDS.values()
    assert {n for kind in kinds for n in kind.meanings} == set(contact_kinds.CONTACT_STATES)
    assert all(set(kind.state_words) == set(kind.meanings) for kind in kinds)


def test_the_engine_has_the_states_and_clocks_of_the_table(tmp_path: Path) -> None:
    numbers = {f"CONTACT_{n}": v for n, v in contact_kinds.STATES.items()}
    numbers |= {f"TICK_{n.upper()}": v for n, v in contact_kinds.TICK_BITS.items()}
    assert compiled("model/model.h", list(numbers), tmp_path) == [*numbers.values()]


def test_every_function_of_fmi_has_its_names() -> None:
    assert sorted(instance.FUNCTIONS) == list(range(instance.F.COUNT))


@pytest.fixture
def header(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Declarations of a text."""
    monkeypatch.setattr(c_structures, "_ROOT", tmp_path)

    def read(text: str) -> Declarations:
        (tmp_path / "a.h").write_text(text)
        return Declarations("a.h")

    return read


def test_arrays_pointers_and_structures_within(header) -> None:
    text = """
    enum { N = 3, M = N + 2 }; /* typedef struct { int no; } Comment; */
    typedef enum { ONE, TWO = 7, THREE } Kind;
    typedef struct { const double *a, *b; signed char s[M]; Kind kind; } Inner;
    typedef struct { Inner inner; void *f[N]; } Outer;
    """
    inner, outer = header(text).structure("Inner"), header(text).structure("Outer")
    assert [(f, k._length_ if f == "s" else k) for f, k in inner._fields_] == [
        *(("a", ctypes.c_void_p), ("b", ctypes.c_void_p), ("s", 5), ("kind", ctypes.c_int))
    ]
    assert ctypes.sizeof(outer) == ctypes.sizeof(inner) + 3 * ctypes.sizeof(ctypes.c_void_p)
    assert vars(header(text).constants("Kind")) == {"ONE": 0, "TWO": 7, "THREE": 8}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("typedef struct { int a : 3; } S;", "'int a : 3' in S is no field"),
        ("typedef struct { int (*f)(void); } S;", r"'int \(\*f\)\(void\)' in S is no field"),
        ("typedef struct { float a; } S;", "the type 'float' in S is none that is known"),
        ("typedef struct { int a[K]; } S;", "'K' in S is no number"),
        ("struct S { int a; };", "a.h declare no structure 'S'"),
    ],
)
def test_what_is_not_read_is_refused(header, text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        header(text).structure("S")


def test_an_enumeration_that_is_not_there_is_refused(header) -> None:
    with pytest.raises(ValueError, match="declare no enumeration 'Kind'"):
        header("enum { A };").constants("Kind")
    with pytest.raises(ValueError, match="'B' of Kind does not begin with K_"):
        header("typedef enum { K_A, B } Kind;").constants("Kind", "K_")
