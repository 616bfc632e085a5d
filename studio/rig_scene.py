"""The rig in 3-D on the page: what stands still, what turns, light and coverage; metres, body frame."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from typing import Any

import numpy as np
import trimesh
import viser
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from cad.colours import colour
from cad.poses import body_from_group
from optics.gaze.kinematics import forward_gaze
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from optics.mirror_outline import mirror_outline
from optics.srgb import srgb_decode
from rigs import Rig
from rigs.gaze import FlatMirror
from studio.results import Parts, Shell, View

FRAMES = {Group.FIXED: "/fixed", Group.PAN: "/pan", Group.TILT: "/m2"}
MIRROR = (120, 190, 230)
MIRROR_BACK_M = 1e-4
"""How far what is drawn of a mirror's face stands in front of its plate."""
RAY = (208, 28, 36)
CONE = (42, 157, 143)
TARGET = (200, 30, 30)
FRUSTUM_M = 0.06
SHELL_M = 1.0
UNLIT = "KHR_materials_unlit"
HANDLE_M, HANDLE_AWAY_M = 0.018, 0.35
"""Radius of what the gaze is dragged by, and how far from the gimbal it is."""
BESIDE_M = 0.8
VIEWPOINT = ((1.9, 1.6, 1.0), (0.15, 0.0, -0.1))
"""Where the page looks from, and what at."""


class RigScene:
    """The 3-D part of the page.

    Parameters
    ----------
    server : ViserServer
    picked : callable
        Takes the name of a part that is clicked.
    pulled : callable
        Takes the direction (body frame) that the gaze is dragged to.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        picked: Callable[[str], None],
        pulled: Callable[[FloatArray], None],
    ) -> None:
        self._scene, self._picked = server.scene, picked
        self._beside: list[Any] = []
        self._parts: dict[str, Any] = {}
        self._layout: Layout | None = None
        server.initial_camera.position, server.initial_camera.look_at = VIEWPOINT
        self._scene.set_up_direction("+z")
        self._scene.configure_environment_map(None)
        self._scene.configure_default_lights(enabled=True, cast_shadow=False)
        self._scene.add_light_ambient("/light", intensity=1.2)
        self._frames = {group: self._scene.add_frame(name, show_axes=False) for group, name in FRAMES.items()}
        self._scene.add_frame("/body", axes_length=0.1, axes_radius=0.002)
        self._handle = self._scene.add_icosphere("/gaze, to be dragged", radius=HANDLE_M, color=CONE)

        @self._handle.on_drag
        async def _(event: viser.SceneNodeDragEvent[Any]) -> None:
            if self._layout is not None:
                pulled(np.array(event.end_position) - self._layout.body_from_gimbal.translation)

    def lay_out(self, rig: Rig) -> None:
        """Draw what follows from the rig's numbers alone: camera, port's axis, mirrors."""
        layout = self._layout = Layout.from_rig(rig)
        camera, gaze = rig.camera, rig.require_gaze()
        self._scene.add_camera_frustum(
            "/camera",
            fov=2 * float(np.arctan(camera.height_px / 2 / camera.fy_px)),
            aspect=camera.width_px / camera.height_px,
            scale=FRUSTUM_M,
            thickness=0.0015,
            color=(233, 163, 61),
            **_placed(layout.body_from_camera),
        )
        self._mirror("/fixed/face of M1", gaze.fold_mirror, layout.body_from_m1)
        self._mirror("/m2/face of M2", gaze.gaze_mirror, RigidTransform.identity())

    def turn(self, q1_deg: float, q2_deg: float) -> None:
        """Put what moves where the joints are."""
        if self._layout is None:
            return
        q1, q2 = (float(q) for q in np.radians([q1_deg, q2_deg]))
        for group, pose in (
            (Group.PAN, self._layout.body_from_pan(q1)),
            (Group.TILT, self._layout.body_from_m2(q1, q2)),
        ):
            frame = self._frames[group]
            frame.wxyz, frame.position = pose.rotation.as_quat(scalar_first=True), pose.translation
        gaze = forward_gaze(self._layout, q1, q2).direction
        self._handle.position = self._layout.body_from_gimbal.translation + HANDLE_AWAY_M * gaze

    def put_parts(self, parts: Parts) -> None:
        """Draw the parts of hull and mount in the place of those before."""
        names = {self._node(mesh) for mesh in parts.meshes}
        for gone in self._parts.keys() - names:
            self._parts.pop(gone).remove()
        for mesh in parts.meshes:
            self._put(mesh)

    def put_beside(self, parts: Parts) -> None:
        """Draw another rig to the left of this one, its joints at zero or as near as they come."""
        for before in self._beside:
            before.remove()
        layout, joints = Layout.from_rig(parts.rig), parts.rig.require_gaze().joints
        q1, q2 = (float(np.radians(np.clip(0, joint.min_deg, joint.max_deg))) for joint in (joints.pan, joints.tilt))
        place = RigidTransform.from_translation([0.0, BESIDE_M, 0.0])
        self._beside = [
            self._scene.add_mesh_simple(
                f"/beside/{mesh.name}",
                mesh.vertices_m,
                mesh.faces,
                color=colour(mesh.role),
                flat_shading=True,
                side="double",
                **_placed(place * body_from_group(layout, mesh.group, q1, q2)),
            )
            for mesh in parts.meshes
        ]
        self._beside.append(self._scene.add_label("/beside/name", parts.rig.name, position=(0.0, BESIDE_M, 0.25)))

    def show_light(self, view: View) -> None:
        """Draw central ray, gaze cone and target of a view."""
        axis = view.axis_m
        self._scene.add_line_segments(
            "/central ray", np.stack([axis[:-1], axis[1:]], axis=1), colors=RAY, thickness=0.003
        )
        begin, end = view.cone_m
        count = len(begin)
        if count:
            following = np.roll(np.arange(count), -1)
            faces = [(k, following[k], k + count) for k in range(count)]
            faces += [(following[k], following[k] + count, k + count) for k in range(count)]
            self._scene.add_mesh_simple(
                "/gaze cone",
                np.concatenate([begin, end]),
                np.array(faces),
                color=CONE,
                opacity=0.25,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )
        self._scene.add_icosphere("/target", radius=view.target_radius_m, color=TARGET, position=view.target_m)

    def show_shell(self, shell: Shell, *, visible: bool) -> None:
        """Draw the covered sphere."""
        # A GLB's colours are linear.
        linear = np.round(255 * srgb_decode(shell.colours / 255)).astype(np.uint8)
        colours = np.concatenate([linear, np.full((len(linear), 1), 255, dtype=np.uint8)], axis=1)
        mesh = trimesh.Trimesh(shell.vertices, shell.faces, process=False, vertex_colors=colours)
        self._scene.add_glb("/covered sphere", unlit_glb(mesh), scale=SHELL_M, visible=visible, cast_shadow=False)

    def _node(self, mesh: PartMesh) -> str:
        return f"{FRAMES[mesh.group]}/{mesh.name}"

    def _put(self, mesh: PartMesh) -> None:
        name = self._node(mesh)
        handle = self._scene.add_mesh_simple(
            name,
            mesh.vertices_m,
            mesh.faces,
            color=colour(mesh.role),
            flat_shading=True,
            side="double",
            opacity=0.0 if mesh.role is Role.MIRROR else None,
        )
        handle.on_click(lambda _: self._picked(mesh.name))
        self._parts[name] = handle

    def _mirror(self, name: str, mirror: FlatMirror, pose: RigidTransform) -> None:
        vertices, faces = plate(mirror)
        self._scene.add_mesh_simple(name, vertices, faces, color=MIRROR, flat_shading=True, **_placed(pose))


def plate(mirror: FlatMirror) -> tuple[FloatArray, NDArray[np.int32]]:
    """Vertices and faces of a mirror's plate in its own axes, metres: a convex prism behind its face."""
    rim = mirror_outline(mirror).rim()
    count = len(rim)
    vertices = np.concatenate(
        [np.column_stack([rim, np.full(count, z)]) for z in (MIRROR_BACK_M, -mirror.thickness_mm / 1000)]
    )
    fan = np.array([(0, k, k + 1) for k in range(1, count - 1)])
    here, following = np.arange(count), np.roll(np.arange(count), -1)
    sides = np.concatenate(
        [
            np.column_stack([here, here + count, following]),
            np.column_stack([following, here + count, following + count]),
        ]
    )
    return vertices, np.concatenate([fan, fan[:, ::-1] + count, sides]).astype(np.int32)


def _placed(pose: RigidTransform) -> dict[str, Any]:
    return {"wxyz": pose.rotation.as_quat(scalar_first=True), "position": pose.translation}


def unlit_glb(mesh: trimesh.Trimesh) -> bytes:
    """GLB of a mesh whose colours are shown as they are: a colour of the legend is that colour everywhere."""
    file = io.BytesIO()
    mesh.export(file, file_type="glb")
    glb = file.getvalue()
    # Twelve bytes of header, then chunks: length, kind, content; the first is JSON.
    length = int.from_bytes(glb[12:16], "little")
    described = json.loads(glb[20 : 20 + length])
    described["extensionsUsed"] = [UNLIT]
    described["materials"] = [{"extensions": {UNLIT: {}}}]
    for primitive in described["meshes"][0]["primitives"]:
        primitive["material"] = 0
    text = json.dumps(described).encode()
    text += b" " * (-len(text) % 4)
    rest = glb[20 + length :]
    size = 20 + len(text) + len(rest)
    return glb[:8] + size.to_bytes(4, "little") + len(text).to_bytes(4, "little") + glb[16:20] + text + rest
