"""What is known of an image and nobody on the robot knows: where target and gaze were, and why one missed the other.

The target's image is told apart by the labels that were rendered with it. What it would be with nothing in its way is
its outline, carried through the exact train.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from dives.looked_at import filled
from dives.metrics.causes import CLIPPED, blown_and_dark, cause_of_loss
from dives.rendered_camera import Exposure
from optics.gaze.kinematics import gaze_mirror_normal
from optics.kernels.arrays import FloatArray
from optics.layout import Layout, camera_pose
from optics.mirror import PlaneMirror, Reflection
from optics.mirror_outline import Rectangle, mirror_outline
from optics.train import OpticalTrain
from rigs import Rig
from scenes.stage.frame import Label
from scenes.stage.targets import Ball, TargetShape
from tracking.perception import Crop, DetectorSettings
from tracking.perception.corners.exact import corners_of
from tracking.records import Mode, Step

MOUNT_LABELS = (Label.MOUNT, Label.SERVO, Label.MIRROR_BACK)
WORLD_LABELS = (Label.WORLD, Label.DECOY, Label.SNOW)

THINGS = (
    {Label.TARGET: "target", Label.DECOY: "decoy", Label.WORLD: "world", Label.SNOW: "world", Label.HULL: "robot"}
    | dict.fromkeys(MOUNT_LABELS, "robot")
    | {Label.MIRROR: "robot", Label.HOUSING: "robot"}
)
"""What a detector's mask can be on; all else is water or its surface."""

OUTLINE_POINTS = 48
"""Points on a ball's outline: a polygon's area falls 0.3 per cent short of its circle's, which is made up for."""

LARGEST_GRID = 2000
"""Cells along an axis of the grid on which a mesh's area is counted."""

AT_SPEED_LIMIT = 0.9
"""Share of a servo's highest speed from which it turns as fast as it can: deadband and pulses cost it a little."""

Row = dict[str, Any]


class GroundTruthColumns:
    """Truth of a dive, image by image.

    Parameters
    ----------
    rig : Rig
    shape : TargetShape
    detector : DetectorSettings
        With which the loop looks for the target.
    """

    def __init__(self, rig: Rig, shape: TargetShape, detector: DetectorSettings):
        self._rig, self._shape, self._detector = rig, shape, detector
        self._layout = Layout.from_rig(rig)
        self._camera_from_body = camera_pose(rig.camera).inv()
        # What is left of a train when points are unfolded over its mirrors beforehand, and the same for all poses.
        self._bare_train = OpticalTrain.bare(rig)
        self._m1 = PlaneMirror.from_pose(self._layout.body_from_m1).reflection
        centre = self._layout.body_from_camera.translation
        # The camera's centre, and the point a metre in front of it, as M1 shows them.
        self._axis_in_m1 = self._m1.apply([centre, self._layout.body_from_camera.apply([0.0, 0.0, 1.0])])
        self._corners = corners_of(rig)
        self._outline = mirror_outline(rig.require_gaze().gaze_mirror)
        servos = rig.require_gaze().servos
        self._speed_rad_per_s = np.radians([servos.pan.speed_deg_per_s, servos.tilt.speed_deg_per_s])

    def corners_px(self, q: FloatArray) -> FloatArray:
        """Corners of the gaze mirror in the image at true joint values, shape (4, 2)."""
        return self._corners.corners(q)

    def of(self, exposure: Exposure, step: Step, speed_rad_per_s: FloatArray) -> Row:
        """Columns of one image.

        Parameters
        ----------
        exposure : Exposure
        step : Step
            What the loop made of it.
        speed_rad_per_s : array, shape (2,)
            Of the true joints during the exposure.
        """
        state = exposure.state
        q = np.array([state.q1, state.q2])
        assert state.world_from_body is not None and state.world_from_target is not None  # a dive knows both
        body_from_target = state.world_from_body.inv() * state.world_from_target
        corners = self.corners_px(q)
        row = self.directions(q, body_from_target)
        centre, full_px, outlines = self._silhouette(q, body_from_target)
        height, width = step.crop.shape[:2]
        crop = Crop.of(corners, width, height, self._outline)
        size = exposure.label.shape[1::-1]
        mirror = filled([corners if isinstance(self._outline, Rectangle) else crop.rim_px()], size)
        would_show = cv2.bitwise_and(filled(outlines, size), mirror)
        # Beside the mirror the crop goes on to a horizon, towards which its pixels grow beyond all bounds.
        x, y = crop.from_image(centre[np.newaxis])[0].tolist() if would_show.any() else (np.nan, np.nan)
        row["true_x_px"], row["true_y_px"] = x, y
        target = np.where(exposure.label == Label.TARGET, mirror, np.uint8(0))
        row["target_visible_px"] = int(cv2.countNonZero(target))
        row["target_full_px"] = full_px
        seen = _in_crop(target, step)
        row |= _agreement(seen, step.detection.mask)
        row["detected_thing"] = _thing_under(step, exposure.label)
        row["saturated_fraction"] = _clipped_share(step.crop)
        row["cause_of_loss"] = self._cause(
            exposure=exposure,
            step=step,
            row=row,
            corners_px=corners,
            there=exposure.label[would_show > 0],
            seen=seen,
            speed_rad_per_s=speed_rad_per_s,
        )
        return row

    def directions(self, q: FloatArray, body_from_target: RigidTransform) -> Row:
        """Directions from M2 and from the virtual camera to the target, and where the axis points.

        At true joint values, radians, shape (2,). `gaze_error_deg` is the angle at the virtual camera's centre between
        its axis and the target's origin.
        """
        place = body_from_target.translation
        from_mirror = place - self._layout.body_from_gimbal.translation
        # The virtual camera's centre and axis are the real one's, reflected over M1 and M2.
        centre, ahead = self._gaze_mirror(q).apply(self._axis_in_m1)
        axis, to_target = ahead - centre, place - centre
        error = np.arctan2(np.linalg.norm(np.cross(axis, to_target)), axis @ to_target)
        azimuth, elevation = angles_deg(from_mirror)
        gaze_azimuth, gaze_elevation = angles_deg(axis)
        return {
            "true_azimuth_deg": azimuth,
            "true_elevation_deg": elevation,
            "target_distance_m": float(np.linalg.norm(from_mirror)),
            "gaze_azimuth_deg": gaze_azimuth,
            "gaze_elevation_deg": gaze_elevation,
            "gaze_error_deg": float(np.degrees(error)),
        }

    def _silhouette(
        self, q: FloatArray, body_from_target: RigidTransform
    ) -> tuple[FloatArray, float, list[FloatArray]]:
        """The target over both mirrors with nothing in its way and the mirrors without edges.

        Returns
        -------
        centre_px : array, shape (2,)
            Image of the target's origin.
        area_px : float
            nan where part of it has no image, or one more than the camera's width beside it: near the port's
            critical angle images grow beyond all bounds.
        outlines_px : list of array, shape (k, 2)
            Convex polygons that together cover it.
        """
        m2 = self._gaze_mirror(q)
        if isinstance(self._shape, Ball):
            place = body_from_target.translation
            eye = m2.apply(self._axis_in_m1[0]) - place
            points = self._projected(m2, np.vstack([place, place + _ball_outline(self._shape.radius_m, eye)]))
            outlines = [points[1:]]
            area = _polygon_area(points[1:]) * _circle_over_polygon(OUTLINE_POINTS)
        else:
            surface = self._shape.surface
            vertices = body_from_target.apply(surface.vertices_m)
            points = self._projected(m2, np.vstack([body_from_target.translation, vertices]))
            outlines = list(points[1:][surface.faces])
            area = _covered_area(outlines)
        camera = self._rig.camera
        beside = np.abs(points[0] - [camera.cx_px, camera.cy_px]).max()
        # nan compares as false.
        return points[0], area if beside < 1.5 * camera.width_px else np.nan, outlines

    def _gaze_mirror(self, q: FloatArray) -> Reflection:
        """Reflection over M2 in the body frame."""
        normal = gaze_mirror_normal(self._layout, *q)
        return Reflection(normal=normal, offset_m=float(normal @ self._layout.body_from_gimbal.translation))

    def _projected(self, m2: Reflection, points_m: FloatArray) -> FloatArray:
        """Pixels of points of the body frame over both mirrors, edges or not; nan behind M2."""
        image = self._camera_from_body.apply(self._m1.apply(m2.apply(points_m)))
        pixels = self._bare_train.project(image).pixels
        return np.where((points_m @ m2.normal > m2.offset_m)[:, np.newaxis], pixels, np.nan)

    def _cause(
        self,
        *,
        exposure: Exposure,
        step: Step,
        row: Row,
        corners_px: FloatArray,
        there: NDArray[np.uint8],
        seen: NDArray[np.bool_],
        speed_rad_per_s: FloatArray,
    ) -> str:
        """Why the target was not found; empty where the detector's mask met it.

        `there`: labels of the pixels in which the gaze mirror would show the target if nothing hid it.
        """
        found = row["detector_both_px"] > 0 and bool(step.detection.blobs)
        if found:
            return ""
        outline_px = abs(_polygon_area(corners_px))
        smallest = self._detector.area_min_px * outline_px / (step.crop.shape[0] * step.crop.shape[1])
        saturated, dark = blown_and_dark(step.crop[seen], value_min=255 * self._detector.window.value_min)
        turning = np.abs(speed_rad_per_s) > AT_SPEED_LIMIT * self._speed_rad_per_s
        return str(
            cause_of_loss(
                found=False,
                full_px=row["target_full_px"],
                hull_px=int((there == Label.HULL).sum()),
                mount_px=int(np.isin(there, MOUNT_LABELS).sum()),
                world_px=int(np.isin(there, WORLD_LABELS).sum()),
                visible_px=row["target_visible_px"],
                smallest_px=smallest if np.isfinite(smallest) else 0.0,
                at_speed_limit=step.mode in (Mode.TRACK, Mode.PREDICT) and bool(turning.any()),
                smear_px=exposure.smear_px,
                saturated_share=saturated,
                dark_share=dark,
            )
        )


def angles_deg(vector: FloatArray) -> tuple[float, float]:
    """Azimuth and elevation of a vector of the body frame, degrees."""
    x, y, z = vector.tolist()
    return float(np.degrees(np.arctan2(y, x))), float(np.degrees(np.arctan2(z, np.hypot(x, y))))


def _ball_outline(radius_m: float, eye_m: FloatArray) -> FloatArray:
    """Circle in which lines of sight from a point touch a ball about the origin, shape (k, 3).

    Through a port there is no single eye; at the distances of targets its place matters in the second order.
    """
    distance = float(np.linalg.norm(eye_m))
    towards = eye_m / distance
    sine = min(radius_m / distance, 1.0)
    side = np.cross(towards, np.eye(3)[np.abs(towards).argmin()])
    side /= np.linalg.norm(side)
    angle = np.linspace(0, 2 * np.pi, OUTLINE_POINTS, endpoint=False)[:, np.newaxis]
    round_it = np.cos(angle) * side + np.sin(angle) * np.cross(towards, side)
    return np.asarray(radius_m * (sine * towards + np.sqrt(1 - sine**2) * round_it))


def _circle_over_polygon(corners: int) -> float:
    """Area of a circle over that of a regular polygon whose corners are on it."""
    return float(2 * np.pi / (corners * np.sin(2 * np.pi / corners)))


def _polygon_area(points: FloatArray) -> float:
    """Area of a polygon, shape (k, 2), without its sense (the shoelace formula)."""
    x, y = points.T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)


def _covered_area(outlines_px: list[FloatArray]) -> float:
    """Area that convex polygons cover together, by drawing them on a grid of their own: quarter pixels or coarser."""
    every = np.concatenate(outlines_px)
    if not np.isfinite(every).all():
        return np.nan
    low, high = every.min(axis=0) - 1, every.max(axis=0) + 1
    scale = min(4.0, LARGEST_GRID / float((high - low).max()))
    size = np.ceil((high - low) * scale).astype(int)
    drawn = filled([(outline - low) * scale for outline in outlines_px], (int(size[0]), int(size[1])))
    return float(cv2.countNonZero(drawn) / scale**2)


def _in_crop(target: NDArray[np.uint8], step: Step) -> NDArray[np.bool_]:
    """Which pixels of the loop's own crop show the target, shape (crop height, crop width)."""
    crop = Crop.of(step.corners_px, *step.crop.shape[1::-1])
    if crop.empty:
        return np.zeros(step.crop.shape[:2], dtype=np.bool_)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpPerspective(target, crop.image_from_crop, step.crop.shape[1::-1], flags=flags) > 127)


def _thing_under(step: Step, label: NDArray[np.uint8]) -> str:
    """What most of the detector's mask is on (`THINGS`, or "water"); empty without a mask."""
    crop = Crop.of(step.corners_px, *step.crop.shape[1::-1])
    if crop.empty or not step.detection.blobs:
        return ""
    flags = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
    labels = np.asarray(cv2.warpPerspective(label, crop.image_from_crop, step.crop.shape[1::-1], flags=flags))
    counts = np.bincount(labels[step.detection.mask > 0], minlength=max(Label) + 1)
    return THINGS.get(Label(int(counts.argmax())), "water") if counts.any() else ""


def _clipped_share(image: NDArray[np.uint8]) -> float:
    """Share of pixels with a channel at its end."""
    red, green, blue = cv2.split(image)
    brightest = cv2.max(cv2.max(red, green), blue)
    return float(np.count_nonzero(np.asarray(brightest) == CLIPPED) / brightest.size)


def _agreement(seen: NDArray[np.bool_], mask: NDArray[np.uint8]) -> Row:
    found = mask > 0
    return {
        "detector_true_px": int(np.count_nonzero(seen)),
        "detector_found_px": int(np.count_nonzero(found)),
        "detector_both_px": int(np.count_nonzero(seen & found)),
    }
