"""Whether the mount sits on its hull, and leaves the port its view and the camera its room."""

from __future__ import annotations

from collections.abc import Sequence

import manifold3d
import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from cad.finding import Finding, Sense
from cad.hulls.anchors import LARGEST_GAP_MM, anchor_problems, base_anchor, fold_anchor, nearest_on_surface
from cad.hulls.camera_housing import HOUSING_MM, housing_body, housing_radius_mm
from cad.hulls.window import window_body
from cad.loads.holding import holdings
from cad.loads.joint_strength import joint_strength
from cad.overlaps import OVERLAP_TOLERANCE_MM3, manifold_mm
from cad.parts.contact import ROUGH_MM, SHEET_MM, SurfaceContact
from cad.parts.flange import fold_seat
from cad.parts.gimbal_base import base_placement, flange_seat
from cad.parts.gimbal_dimensions import GimbalDimensions
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from optics.mirror_outline import mirror_outline
from rigs import DomePortSpec, FlatPortSpec, Problem, Rig

ANCHOR_CHECK = "anchor on the hull"
VIEW_CHECK = "view of the port"
HOUSING_CHECK = "room for the camera"
BEDDING_CHECK = "bedding under the flange"
HOLDING_CHECK = "attachment holds"
JOINT_CHECK = "joint holds"
PORT_VIEW_TOLERANCE_MM3 = 1.0
RIM_POINTS = 64
DOME_SEGMENTS = 128


def attachment_findings(rig: Rig, hull: PartMesh, layout: Layout) -> list[Finding]:
    """Anchors on the hull's surface, and no part of the hull between the port and M1."""
    surface = trimesh.Trimesh(1000 * hull.vertices_m, hull.faces, process=False)
    problems = {problem.place: problem for problem in anchor_problems(rig, surface)}
    findings = []
    for end, anchor in (("fold", fold_anchor(rig)), ("base", base_anchor(rig))):
        _, _, gap = nearest_on_surface(surface, anchor.point_mm)
        places = [place for place in problems if place.startswith(f"mount.{end}_")]
        findings.append(
            Finding(
                check=ANCHOR_CHECK,
                subject=f"{end} anchor",
                figure=gap,
                unit="mm",
                limit=LARGEST_GAP_MM,
                sense=Sense.AT_MOST,
                place="at (" + ", ".join(f"{value:.1f}" for value in anchor.point_mm) + ") mm of the body",
                note="from the hull's surface",
                problem=problems[places[0]] if places else None,
            )
        )
    return [*findings, *_bedding(rig, layout), _view_of_the_port(rig, hull, layout)]


def _bedding(rig: Rig, layout: Layout) -> list[Finding]:
    """How thick the bed is that a flange needs on a hull from a file: the hull's steps under it."""
    if rig.file_hull is None:
        return []
    seats = {"fold": fold_seat(rig), "base": flange_seat(rig, base_placement(GimbalDimensions.from_rig(rig), layout))}
    return [
        Finding(
            check=BEDDING_CHECK,
            subject=f"{end} flange",
            figure=seat.contact.error_mm if isinstance(seat.contact, SurfaceContact) else 0.0,
            unit="mm",
            limit=ROUGH_MM,
            sense=Sense.AT_MOST,
            note=f"steps of the hull under it; a neoprene sheet takes up {SHEET_MM:g} mm, a bed of epoxy putty more",
        )
        for end, seat in seats.items()
    ]


def holding_findings(rig: Rig, meshes: Sequence[PartMesh]) -> list[Finding]:
    """Screws, bands and pads that bear what hangs on them."""
    findings = []
    for holding in holdings(rig, meshes):
        load = f"{holding.force_n:.1f} N and {holding.moment_n_m:.2f} N m"
        problem = Problem(
            place=f"mount.{holding.end}_attachment",
            value=holding.attachment,
            expected=f"what holds {load} at the {holding.end} anchor: it holds {holding.margin:.0%} of that; "
            "take screws, or a nearer anchor",
        )
        findings.append(
            Finding(
                check=HOLDING_CHECK,
                subject=f"{holding.end} anchor, {holding.attachment}",
                figure=holding.margin,
                unit="times what it must",
                limit=1.0,
                note=f"{load}, safety factors included",
                problem=problem if holding.margin < 1 else None,
            )
        )
    return findings


def joint_findings(rig: Rig, meshes: Sequence[PartMesh]) -> list[Finding]:
    """The joint of a fold bracket in halves bears what hangs on it; nothing for one in one piece."""
    strength = joint_strength(rig, meshes)
    if strength is None:
        return []
    load = f"{strength.force_n:.1f} N and {strength.moment_n_m:.2f} N m"
    problem = Problem(
        place="mount.printer_bed_mm",
        value=rig.require_gaze().mount.printer_bed_mm,
        expected=f"a joint of the fold bracket's halves that holds {load}: it holds {strength.margin:.0%} of that; "
        "take a printer that makes it whole, or a nearer anchor",
    )
    screws = f"{strength.pull_n:.0f} N pull and {strength.shear_n:.0f} N shear on a screw"
    return [
        Finding(
            check=JOINT_CHECK,
            subject="fold bracket's halves",
            figure=strength.margin,
            unit="times what it must",
            limit=1.0,
            note=f"{load}: {screws}, {strength.stress_pa / 1e6:.1f} MPa in its plates; M1 tilts by at most "
            f"{np.degrees(strength.tilt_rad):.3f} degrees",
            problem=problem if strength.margin < 1 else None,
        )
    ]


def housing_findings(rig: Rig, meshes: Sequence[PartMesh]) -> list[Finding]:
    """No fixed part, nor the end of a screw, in the camera behind its port.

    Our own hulls are solid there, and what is in them is found as parts in each other; the hull of a file has a hole or
    is a sheet.
    """
    radius = housing_radius_mm(rig)
    if rig.file_hull is None or not radius:
        return []
    housing = housing_body(rig)
    fixed = [mesh for mesh in meshes if mesh.group is Group.FIXED and mesh.role is not Role.HULL]
    shared = {mesh.name: (housing ^ manifold_mm(mesh)).volume() for mesh in fixed}
    name = max(shared, key=lambda part: shared[part])
    end = "base" if "base" in name or "gimbal" in name else "fold"
    problem = Problem(
        place=f"mount.{end}_anchor_mm",
        value=f"{shared[name]:.0f} mm³ of {name} in the camera",
        expected=f"nothing of the mount within {radius:g} mm of the camera's view, {HOUSING_MM:g} mm back from its "
        "port's face; take another anchor, or move the camera",
    )
    return [
        Finding(
            check=HOUSING_CHECK,
            subject=name,
            figure=shared[name],
            unit="mm³",
            limit=OVERLAP_TOLERANCE_MM3,
            sense=Sense.AT_MOST,
            note=f"in a cylinder of {2 * radius:g} mm, {HOUSING_MM:g} mm back from the port's face",
            problem=problem if shared[name] > OVERLAP_TOLERANCE_MM3 else None,
        )
    ]


def _view_of_the_port(rig: Rig, hull: PartMesh, layout: Layout) -> Finding:
    """No part of the hull stands between the port and M1."""
    light = _light_to_fold_mirror(rig, layout)
    if rig.file_hull is not None and rig.file_hull.window == "clear":
        light = light - window_body(rig)
    shared = (light ^ manifold_mm(hull)).volume()
    expected = "a camera whose port looks into the water: the hull stands in front of it"
    problem = Problem(place="camera.position_mm", value=rig.camera.position_mm, expected=expected)
    return Finding(
        check=VIEW_CHECK,
        subject=hull.name,
        figure=shared,
        unit="mm³",
        limit=PORT_VIEW_TOLERANCE_MM3,
        sense=Sense.AT_MOST,
        note="of the hull in the light from the port to M1",
        problem=problem if shared > PORT_VIEW_TOLERANCE_MM3 else None,
    )


def _light_to_fold_mirror(rig: Rig, layout: Layout) -> manifold3d.Manifold:
    """Water that light crosses from the port to M1, as a body in the body frame, millimetres.

    Behind a flat port that is all in front of its aperture, whatever the refraction; else the pyramid from the
    pinhole to M1, less the dome.
    """
    gaze = rig.require_gaze()
    body_from_camera = layout.body_from_camera
    if isinstance(rig.port, FlatPortSpec):
        normal = np.array(rig.port.normal) / np.linalg.norm(rig.port.normal)
        around = Rotation.align_vectors(normal, [0, 0, 1])[0]
        angles = np.linspace(0, 2 * np.pi, RIM_POINTS, endpoint=False)
        rim = rig.port.aperture_diameter_mm / 2 * around.apply(_circle(angles))
        start = (rig.port.distance_mm + rig.port.thickness_mm) * normal
        end = start + gaze.fold_mirror.distance_mm * normal
        return _hull_of(body_from_camera.apply(np.vstack([rim + start, rim + end]) / 1000))
    rim = mirror_outline(gaze.fold_mirror).rim()
    corners = np.column_stack([rim, np.zeros(len(rim))])
    light = _hull_of(np.vstack([body_from_camera.translation, layout.body_from_m1.apply(corners)]))
    if isinstance(rig.port, DomePortSpec):
        dome = manifold3d.Manifold.sphere(rig.port.inner_radius_mm + rig.port.thickness_mm, DOME_SEGMENTS)
        centre = 1000 * body_from_camera.apply(np.array(rig.port.centre_mm) / 1000)
        light = light - dome.translate(tuple(centre))
    return light


def _circle(angles: FloatArray) -> FloatArray:
    return np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])


def _hull_of(points_m: FloatArray) -> manifold3d.Manifold:
    """Convex hull of points, millimetres."""
    return manifold3d.Manifold.hull_points(np.ascontiguousarray(1000 * points_m))
