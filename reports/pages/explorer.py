"""A rig to explore in one HTML file: solids that move, views on a grid, who sees a direction, numbers, what to buy."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import PartMesh
from reports.pages import content
from reports.pages.page import STYLE, html

TEMPLATE = Path(__file__).parent / "explorer.html"


@dataclass(frozen=True, kw_only=True)
class JointGridView:
    """An image of the camera at joint values (degrees), as the bytes of a JPEG."""

    q1_deg: float
    q2_deg: float
    jpeg: bytes


@dataclass(frozen=True, kw_only=True)
class WhoSees:
    """Which poses show which directions.

    Attributes
    ----------
    q_deg : array, shape (poses, 2)
        Joint values.
    directions : array, shape (cells, 3)
        Middles of cells of equal solid angle, unit vectors in the body frame.
    seen : array of bool, shape (poses, cells)
    """

    q_deg: FloatArray
    directions: FloatArray
    seen: NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True)
class ExplorerResults:
    """What the file holds beside the rig's own numbers."""

    parts: Sequence[PartMesh]
    colours: Sequence[tuple[int, int, int]]
    views: Sequence[JointGridView]
    who_sees: WhoSees
    head: Sequence[content.Block]
    tail: Sequence[content.Block]


def explorer_page(title: str, layout: Layout, results: ExplorerResults) -> str:
    """The whole file; it opens from disk and fetches nothing."""
    data = {
        "parts": [_part(part, colour) for part, colour in zip(results.parts, results.colours, strict=True)],
        "kinematics": kinematics(layout),
        "views": [
            {"q_deg": [view.q1_deg, view.q2_deg], "jpeg": base64.b64encode(view.jpeg).decode("ascii")}
            for view in results.views
        ],
        "who_sees": {
            "q_deg": results.who_sees.q_deg.tolist(),
            "directions": _packed(results.who_sees.directions, np.float32),
            "seen": base64.b64encode(np.packbits(results.who_sees.seen, axis=1).tobytes()).decode("ascii"),
        },
    }
    # What ends a script must not stand in it.
    text = json.dumps(data).replace("</", "<\\/")
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(
        title=escape(title),
        style=STYLE.read_text(encoding="utf-8"),
        head="\n".join(map(html, results.head)),
        tail="\n".join(map(html, results.tail)),
        data=text,
    )


def kinematics(layout: Layout) -> dict[str, Any]:
    """Numbers of the closed form of frames and gaze, as the file's script takes them; metres and radians."""
    camera, gimbal = layout.body_from_camera.rotation.as_matrix(), layout.body_from_gimbal
    joints = {"pan": layout.pan, "tilt": layout.tilt}
    return {
        "right": camera[:, 0].tolist(),
        "forward": camera[:, 2].tolist(),
        "m1_normal": layout.body_from_m1.rotation.as_matrix()[:, 2].tolist(),
        "gimbal_rotation": gimbal.rotation.as_matrix().tolist(),
        "gimbal_m": gimbal.translation.tolist(),
        "joints": {
            name: {
                # The angle at q = 0, and by how much a radian of q turns.
                "offset": float(joint.angle(0.0)),
                "sign": float(joint.angle(1.0) - joint.angle(0.0)),
                "min_deg": joint.min_deg,
                "max_deg": joint.max_deg,
            }
            for name, joint in joints.items()
        },
    }


def _part(part: PartMesh, colour: tuple[int, int, int]) -> dict[str, Any]:
    return {
        "name": part.name,
        "group": part.group.value,
        "role": part.role.value,
        "colour": list(colour),
        "vertices": _packed(part.vertices_m, np.float32),
        "faces": _packed(part.faces, np.uint32),
    }


def _packed(values: NDArray[Any], kind: type[np.generic]) -> str:
    little = np.ascontiguousarray(values, dtype=np.dtype(kind).newbyteorder("<"))
    return base64.b64encode(little.tobytes()).decode("ascii")
