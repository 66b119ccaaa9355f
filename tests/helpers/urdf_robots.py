"""Robots as URDF: the two-link arm of data/machines, and trees of links that turn and slide."""

from __future__ import annotations

from collections.abc import Sequence

from emulated_arm import ARM

LIMIT = '<limit effort="9" velocity="9" lower="-9" upper="9"/>'
AXES = ("0 0 1", "0 1 0", "0.6 0 0.8", "1 0 0", "0 -1 0", "0.36 0.48 0.8", "0 0 1")
QUARTER = "1.57079632679"  # as files have it


def link(name: str, mass: float = 0.0, centre: str = "0 0 0", inertia: str = "", rpy: str = "0 0 0") -> str:
    inertia += "".join(f' i{pair}="0"' for pair in ("xx", "yy", "zz", "xy", "xz", "yz") if f"i{pair}=" not in inertia)
    return (
        f'<link name="{name}"><inertial><origin xyz="{centre}" rpy="{rpy}"/><mass value="{mass}"/>'
        f"<inertia {inertia}/></inertial></link>"
    )


def joint(name: str, kind: str, parent: str, child: str, xyz: str = "0 0 0", axis: str = "0 1 0", rpy: str = "") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy or "0 0 0"}"/><axis xyz="{axis}"/>{LIMIT}</joint>'
    )


def arm() -> str:
    """The two-link arm of data/machines, hanging; the lower link's inertia in a frame that is turned."""
    p = ARM
    upper, lower = p["J1"] - p["m1"] * p["r1"] ** 2, p["J2"] - p["m2"] * p["r2"] ** 2
    parts = [
        '<link name="base"/>',
        link("upper", p["m1"], f"0 0 -{p['r1']}", f'iyy="{upper!r}"'),
        link("lower", p["m2"], f"0 0 -{p['r2']}", f'ixx="{lower!r}"', rpy=f"0 0 {QUARTER}"),
        joint("shoulder", "revolute", "base", "upper"),
        joint("elbow", "continuous", "upper", "lower", xyz=f"0 0 -{p['l1']}", axis="0 2 0"),
    ]
    return f'<robot name="two-link arm">{"".join(parts)}</robot>'


def robot(carriers: Sequence[int], kinds: Sequence[str]) -> str:
    """carriers: number of the link that carries each, 0: the base; kinds: of the joints, at most seven; every second
    link has a tool that is fixed to it."""
    parts = ['<robot name="tree"><link name="link0"/>']
    for i, (carrier, kind, axis) in enumerate(zip(carriers, kinds, AXES, strict=False), 1):
        parts.append(_body(f"link{i}", i))
        place = f'xyz="{0.1 * i - 0.2} {0.05 * i} {0.3 - 0.02 * i}" rpy="{0.3 * i} {0.2 - 0.1 * i} {0.7 * i}"'
        parts.append(
            f'<joint name="joint{i}" type="{kind}"><parent link="link{carrier}"/><child link="link{i}"/>'
            f'<origin {place}/><axis xyz="{axis}"/>{LIMIT}</joint>'
        )
        if i % 2:
            parts.append(_body(f"tool{i}", 0.3 * i))
            parts.append(
                f'<joint name="flange{i}" type="fixed"><parent link="link{i}"/><child link="tool{i}"/>'
                '<origin xyz="0.1 -0.2 0.05" rpy="0.4 0.5 -0.6"/></joint>'
            )
    return "".join([*parts, "</robot>"])


def _body(name: str, size: float) -> str:
    inertia = f'ixx="{0.3 * size}" iyy="{0.4 * size}" izz="{0.5 * size}" ixy="0.01" ixz="-0.02" iyz="0.03"'
    return link(name, 1 + 0.2 * size, f"0.02 0.01 {0.03 * size}", inertia, rpy="0.1 0.2 0.3")
