"""The trade-off over d1 and d2 (figure 1 of the paper): near mirrors see the robot itself, far ones are huge.

For each pair of distances the mirrors are sized for the same request, and judged: area, mass, what hull and mirrors
hide, the space that M2 sweeps, and whether it all fits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import RigidTransform

from optics.coverage.usable_fov import usable_fov
from optics.feasibility.envelope import HullDistance
from optics.kernels.arrays import FloatArray
from optics.layout import Layout
from optics.mesh import Group, PartMesh, Role
from optics.mirror_outline import OUTLINES, mirror_outline
from optics.sizing.footprint import centred_extents
from optics.sizing.gaze_range import GazeRange, Grid, pose_grid
from optics.sizing.limits import Request, larger_than_bed, out_of_room, with_mirrors
from optics.train import OpticalTrain
from rigs import Rig
from rigs.gaze import FlatMirror

GLASS_DENSITY_KG_M3 = 2500.0
"""Soda-lime float glass, EN 572-1."""

RAYS_PER_SIDE = 8
SIZING_STEPS = 31
"""Values of each range at which mirrors are sized: 5 degrees apart over the whole pan, an arc rises 0.1 % between."""

VIEW_STEPS = 11
"""Values of each joint at which occlusion is counted."""


@dataclass(frozen=True, kw_only=True)
class TradeOff:
    """n1 x n2 designs; arrays of shape (n2, n1, ...), NaN where no finite mirror does.

    Attributes
    ----------
    d1_mm : array, shape (n1,)
    d2_mm : array, shape (n2,)
    outlines : (str, str)
        Of M1 and M2, by their names in the rig file.
    m1_mm, m2_mm : arrays, shape (n2, n1, 2)
        Width and height of the mirrors, with the outlines of the rig, margins included, rounded up to 0.5 mm.
    hull_share : array
        Share that the hull hides of what the bare mirrors show, by solid angle, over the joints' whole range.
    plate_share : array
        Share that the mirrors' own plates hide, such as M1 when M2 looks up, likewise.
    mass_kg : array
        Both plates, glass of 2500 kg/m^3: without holders, servos and bracket.
    moment_kg_m : array, shape (n2, n1, 3)
        Mass of the plates times the position of their centres, body frame. Over the robot's whole mass it is the
        shift of its centre of mass.
    sphere_l : array
        Volume of the sphere in which M2's plate turns, litres.
    cylinder_l : array
        Volume of the cylinder about the pan axis in which the yoke turns, litres; see `swept_cylinder_m3`.
    constraint : tuple of tuples of str
        Name of what binds first, "" where all fits.
    """

    d1_mm: FloatArray
    d2_mm: FloatArray
    outlines: tuple[str, str]
    m1_mm: FloatArray
    m2_mm: FloatArray
    hull_share: FloatArray
    plate_share: FloatArray
    mass_kg: FloatArray
    moment_kg_m: FloatArray
    sphere_l: FloatArray
    cylinder_l: FloatArray
    constraint: tuple[tuple[str, ...], ...]

    @property
    def m1_cm2(self) -> FloatArray:
        """Area of M1."""
        return _area_cm2(self.outlines[0], self.m1_mm)

    @property
    def m2_cm2(self) -> FloatArray:
        """Area of M2."""
        return _area_cm2(self.outlines[1], self.m2_mm)

    @property
    def fits(self) -> NDArray[np.bool_]:
        """Designs without a constraint in their way."""
        return np.array([[constraint == "" for constraint in row] for row in self.constraint])


def trade_off(
    rig: Rig,
    request: Request,
    hull: Sequence[PartMesh],
    *,
    d1_mm: ArrayLike,
    d2_mm: ArrayLike,
    distance: HullDistance | None = None,
) -> TradeOff:
    """Size and judge all pairs of distances.

    Parameters
    ----------
    rig : Rig
        With mirrors; its distances and sizes are replaced.
    request : Request
        The part of it that the joints reach is used.
    hull : sequence of PartMesh
        The robot's body, for occlusion.
    d1_mm, d2_mm : arrays, shape (n1,) and (n2,)
        Pinhole to M1, M1 to M2.
    distance : callable, optional
        Distance of points from the hull, as for `optics.feasibility.feasibility.feasibility_problems`.

    Raises
    ------
    ValueError
        For distances that are not positive, or a range or window nothing of which can be reached.
    """
    d1, d2 = (_distances(name, values) for name, values in (("d1_mm", d1_mm), ("d2_mm", d2_mm)))
    grid = pose_grid(Layout.from_rig(rig), request.gaze, SIZING_STEPS)
    rays = OpticalTrain.bare(rig).trace(request.window.boundary(RAYS_PER_SIDE))
    if not grid.reached.any() or not rays.passed.all():
        raise ValueError("expected a range that the joints reach and a window that the port lets through")
    grid1, grid2 = (values.ravel() / 1000 for values in np.meshgrid(d1, d2))
    extents = centred_extents(
        rig,
        rays,
        d1_m=grid1,
        d2_m=grid2,
        q1=grid.q1[grid.reached],
        q2=grid.q2[grid.reached],
        margin_m=request.margin_m,
        angle_tolerance=request.angle_tolerance,
    )
    layout = Layout.from_rig(rig)
    views = pose_grid(layout, GazeRange.of_joints(layout), VIEW_STEPS)
    designs = [
        _judged(sized, hull, views, distance)
        for sized in (
            _sized(_at(rig, float(1000 * a), float(1000 * b)), 2 * m1, 2 * m2)
            for a, b, m1, m2 in zip(grid1, grid2, extents.m1_m, extents.m2_m, strict=True)
        )
    ]

    def column(name: str) -> FloatArray:
        values = np.array([getattr(design, name) for design in designs], dtype=np.float64)
        return values.reshape(len(d2), len(d1), *values.shape[1:])

    names = [design.constraint for design in designs]
    return TradeOff(
        d1_mm=d1,
        d2_mm=d2,
        outlines=(rig.require_gaze().fold_mirror.outline, rig.require_gaze().gaze_mirror.outline),
        m1_mm=column("m1_mm"),
        m2_mm=column("m2_mm"),
        hull_share=column("hull_share"),
        plate_share=column("plate_share"),
        mass_kg=column("mass_kg"),
        moment_kg_m=column("moment_kg_m"),
        sphere_l=column("sphere_l"),
        cylinder_l=column("cylinder_l"),
        constraint=tuple(tuple(names[row * len(d1) : (row + 1) * len(d1)]) for row in range(len(d2))),
    )


def swept_sphere_m3(mirror: FlatMirror) -> float:
    """Volume of the sphere around the crossing of the joint axes in which a plate turns."""
    radius = np.hypot(mirror_outline(mirror).radius_m, mirror.thickness_mm / 1000)
    return float(4 / 3 * np.pi * radius**3)


def swept_cylinder_m3(rig: Rig) -> float:
    """Volume of an upright cylinder that stands for what the yoke sweeps about the pan axis.

    Its radius is half of M2's width, a wall and the tilt servo, which lies beside the mirror with its shaft along the
    tilt axis; its height that of M2 face up and face down, with clearance and wall below.
    """
    gaze = rig.require_gaze()
    radius = gaze.gaze_mirror.width_mm / 2 + gaze.mount.wall_mm + gaze.servos.tilt.size_mm[2]
    height = gaze.gaze_mirror.height_mm + gaze.mount.clearance_mm + gaze.mount.wall_mm
    return float(np.pi * radius**2 * height / 1e9)


def plate_part(name: str, mirror: FlatMirror, pose: RigidTransform, group: Group) -> PartMesh:
    """Plate of a mirror as triangles, behind its face, at a pose in its group's frame."""
    rim = mirror_outline(mirror).rim()
    levels = (-mirror.thickness_mm / 1000, 0.0)
    vertices = np.concatenate([np.column_stack([rim, np.full(len(rim), level)]) for level in levels])
    return PartMesh(
        name=name, group=group, role=Role.MIRROR, vertices_m=pose.apply(vertices), faces=prism_faces(len(rim))
    )


def prism_faces(count: int) -> NDArray[np.int32]:
    """Triangles of a prism between two polygons of `count` corners, counter-clockwise, the lower one first."""
    first, second = np.arange(count), np.roll(np.arange(count), -1)
    fan = np.stack([np.zeros(count - 2, dtype=int), first[1:-1], second[1:-1]], axis=1)
    sides = [
        np.stack([first, second, second + count], axis=1),
        np.stack([first, second + count, first + count], axis=1),
    ]
    return np.concatenate([fan[:, ::-1], fan + count, *sides]).astype(np.int32)


@dataclass(frozen=True)
class _Design:
    """One pair of distances; the fields are those of `TradeOff`."""

    m1_mm: tuple[float, ...] = (np.nan, np.nan)
    m2_mm: tuple[float, ...] = (np.nan, np.nan)
    hull_share: float = np.nan
    plate_share: float = np.nan
    mass_kg: float = np.nan
    moment_kg_m: tuple[float, ...] = (np.nan, np.nan, np.nan)
    sphere_l: float = np.nan
    cylinder_l: float = np.nan
    constraint: str = "grazing incidence"


def _sized(rig: Rig, m1_m: FloatArray, m2_m: FloatArray) -> Rig | None:
    """The rig with mirrors of these sides; None where no finite mirror does."""
    if not np.isfinite([*m1_m, *m2_m]).all():
        return None
    return with_mirrors(rig, (float(m1_m[0]), float(m1_m[1])), (float(m2_m[0]), float(m2_m[1])))


def _judged(sized: Rig | None, hull: Sequence[PartMesh], views: Grid, distance: HullDistance | None) -> _Design:
    if sized is None:
        return _Design()
    gaze = sized.require_gaze()
    layout = Layout.from_rig(sized)
    plates = [
        plate_part("fold_mirror", gaze.fold_mirror, layout.body_from_m1, Group.FIXED),
        plate_part("gaze_mirror", gaze.gaze_mirror, RigidTransform.identity(), Group.TILT),
    ]
    bare, past_hull, past_plates = (_seen_sr(sized, parts, views) for parts in ([], hull, plates))
    masses = [_mass_kg(gaze.fold_mirror), _mass_kg(gaze.gaze_mirror)]
    centres = [layout.body_from_m1.translation, layout.body_from_gimbal.translation]
    # The bed first: room for a plate that is far too large takes long to look for.
    bindings = larger_than_bed(sized) or out_of_room(sized, distance)
    return _Design(
        m1_mm=(gaze.fold_mirror.width_mm, gaze.fold_mirror.height_mm),
        m2_mm=(gaze.gaze_mirror.width_mm, gaze.gaze_mirror.height_mm),
        hull_share=1 - past_hull / bare if bare else np.nan,
        plate_share=1 - past_plates / bare if bare else np.nan,
        mass_kg=sum(masses),
        moment_kg_m=tuple(masses[0] * centres[0] + masses[1] * centres[1]),
        sphere_l=1000 * swept_sphere_m3(gaze.gaze_mirror),
        cylinder_l=1000 * swept_cylinder_m3(sized),
        constraint=bindings[0].constraint if bindings else "",
    )


def _seen_sr(rig: Rig, parts: Sequence[PartMesh], views: Grid) -> float:
    return float(usable_fov(rig, parts, q1=views.q1, q2=views.q2).solid_angle_sr.sum())


def _at(rig: Rig, d1_mm: float, d2_mm: float) -> Rig:
    return rig.with_gaze(fold_mirror={"distance_mm": d1_mm}, gaze_mirror={"distance_mm": d2_mm})


def _mass_kg(mirror: FlatMirror) -> float:
    return float(GLASS_DENSITY_KG_M3 * mirror_outline(mirror).area_m2 * mirror.thickness_mm / 1000)


def _area_cm2(name: str, sides_mm: FloatArray) -> FloatArray:
    return np.asarray(OUTLINES[name](half_width=sides_mm[..., 0] / 20, half_height=sides_mm[..., 1] / 20).area_m2)


def _distances(name: str, values: ArrayLike) -> FloatArray:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 1 or not array.size or not (np.isfinite(array) & (array > 0)).all():
        raise ValueError(f"expected {name} of shape (n,), n > 0, positive, got {array}")
    return array
