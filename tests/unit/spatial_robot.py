"""Robots as URDF: trees of links that turn and slide, every second one with a tool that is fixed to it."""

from __future__ import annotations

from collections.abc import Sequence

AXES = ("0 0 1", "0 1 0", "0.6 0 0.8", "1 0 0", "0 -1 0", "0.36 0.48 0.8", "0 0 1")


def robot(carriers: Sequence[int], kinds: Sequence[str]) -> str:
    """carriers: number of the link that carries each, 0: the base; kinds: of the joints, at most seven."""
    parts = ['<robot name="tree"><link name="link0"/>']
    for i, (carrier, kind, axis) in enumerate(zip(carriers, kinds, AXES, strict=False), 1):
        parts.append(_link(f"link{i}", i))
        place = f'xyz="{0.1 * i - 0.2} {0.05 * i} {0.3 - 0.02 * i}" rpy="{0.3 * i} {0.2 - 0.1 * i} {0.7 * i}"'
        parts.append(
            f'<joint name="joint{i}" type="{kind}"><parent link="link{carrier}"/><child link="link{i}"/>'
            f'<origin {place}/><axis xyz="{axis}"/><limit effort="9" velocity="9" lower="-9" upper="9"/></joint>'
        )
        if i % 2:
            parts.append(_link(f"tool{i}", 0.3 * i))
            parts.append(
                f'<joint name="flange{i}" type="fixed"><parent link="link{i}"/><child link="tool{i}"/>'
                '<origin xyz="0.1 -0.2 0.05" rpy="0.4 0.5 -0.6"/></joint>'
            )
    return "".join([*parts, "</robot>"])


def _link(name: str, size: float) -> str:
    inertia = f'ixx="{0.3 * size}" iyy="{0.4 * size}" izz="{0.5 * size}" ixy="0.01" ixz="-0.02" iyz="0.03"'
    return (
        f'<link name="{name}"><inertial><origin xyz="0.02 0.01 {0.03 * size}" rpy="0.1 0.2 0.3"/>'
        f'<mass value="{1 + 0.2 * size}"/><inertia {inertia}/></inertial></link>'
    )
