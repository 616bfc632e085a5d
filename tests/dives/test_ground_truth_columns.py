"""Truth of an image beside the exact train and the ground truth of single frames."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import RigidTransform, Rotation

from cad.assembly.meshes import rig_meshes
from dives.ground_truth_columns import GroundTruthColumns
from dives.rendered_camera import Exposure
from optics.layout import Layout, camera_pose
from optics.mesh import Group, Role
from optics.status import Region
from optics.train import OpticalTrain
from rigs import Rig
from scenes.baking.light_quality import LightQuality
from scenes.baking.lit_scene import prepare
from scenes.renderer import FastRenderer
from scenes.sensor import CameraSettings
from scenes.stage.frame import Label
from scenes.stage.scene import Target, make_scene, on_gaze
from scenes.stage.state import State
from scenes.stage.targets import Ball, target_named
from scenes.truth.silhouette import ball_silhouette
from tracking.perception import RED_BALL, ColourWindow, Crop, DetectorSettings, ExactCorners, detect
from tracking.records import Mode, Step

DEPTH_M = 5.0
RADIUS_M = 0.1
# Where the ball is in the mirror, where the hull hides it (over the zenith, 44 degrees up to the rear), where M1's back
# and its bracket do (steeply up), and where it is beside.
ON_AXIS, REAR, STEEP, BESIDE = (20.0, -5.0), (0.0, 68.0), (30.0, 55.0), (-40.0, 10.0)


@pytest.fixture(scope="module")
def rig():
    return Rig.load("aqua2")


@pytest.fixture(scope="module")
def renderer(rig):
    return FastRenderer(prepare(make_scene(rig, world="blue", depth_m=DEPTH_M), rig, quality=LightQuality.coarse()))


def state(q_deg, place):
    """Joints, a robot that is neither level nor ahead, and a target at a place of the body frame."""
    q1, q2 = np.radians(q_deg)
    world_from_body = RigidTransform.from_components([1.0, 2.0, -DEPTH_M], Rotation.from_euler("zyx", [0.5, 0.1, -0.1]))
    return State(
        q1=q1,
        q2=q2,
        world_from_body=world_from_body,
        world_from_target=RigidTransform.from_translation(world_from_body.apply(place)),
    )


def step_of(rig, now, image, settings=RED_BALL):
    corners = ExactCorners(rig).corners([now.q1, now.q2])
    crop = Crop.of(corners).take(image)
    return Step(
        time_s=0.0,
        mode=Mode.TRACK,
        q_estimated=np.array([now.q1, now.q2]),
        q_command=np.array([now.q1, now.q2]),
        corners_px=corners,
        crop=crop,
        detection=detect(crop, settings),
        predicted_px=None,
        error_px=None,
        beyond_reach=False,
        target_direction=None,
    )


def exposure_of(frame, now):
    settings = CameraSettings(exposure_s=0.005, gain_db=0.0, white_gains=(1.0, 1.0, 1.0))
    return Exposure(
        frame=0,
        time_s=0.0,
        start_s=0.0,
        end_s=0.01,
        settings=settings,
        state=now,
        label=frame.label,
        smear_px=0.0,
        sweeps=1,
    )


def painted(frame, colour=(220, 30, 30), label=Label.TARGET):
    """An image in which nothing but the target has a colour."""
    image = np.zeros((*frame.label.shape, 3), dtype=np.uint8)
    image[frame.label == label] = colour
    return image


def any_red():
    return DetectorSettings(window=ColourWindow(hue_from_deg=340, hue_to_deg=20, saturation_min=0.3, value_min=0.2))


def row_of(rig, renderer, now, *, shape=None, image=None, speed=(0.0, 0.0), mode=Mode.TRACK):
    frame = renderer.render_states([now])[0]
    settings = any_red()
    step = replace(step_of(rig, now, painted(frame) if image is None else image(frame), settings), mode=mode)
    truth = GroundTruthColumns(rig, shape or Ball(radius_m=RADIUS_M), settings)
    return frame, truth.of(exposure_of(frame, now), step, np.array(speed))


def test_a_target_on_the_axis_is_seen_whole_and_without_error(rig, renderer):
    """The axis is the ray of the principal point; the gaze error counts from the pinhole, 1.5 mm beside it at most.

    A flat port has no single centre: by its thickness and distance the ray leaves some millimetres off, which at 2 m is
    a tenth of a degree at most.
    """
    q1, q2 = np.radians(ON_AXIS)
    now = state(ON_AXIS, on_gaze(rig, q1=q1, q2=q2, distance_m=2.0))
    frame, row = row_of(rig, renderer, now)
    assert row["gaze_error_deg"] < 0.1
    assert row["gaze_azimuth_deg"] == pytest.approx(20.0, abs=1e-9)
    assert row["gaze_elevation_deg"] == pytest.approx(-10.0, abs=1e-9)
    assert row["true_azimuth_deg"] == pytest.approx(20.0, abs=0.1)
    assert row["target_visible_px"] == (frame.label == Label.TARGET)[frame.region == Region.GAZE].sum()
    assert row["cause_of_loss"] == ""
    assert row["detected_thing"] == "target"
    assert row["detector_true_px"] == pytest.approx(row["detector_both_px"], rel=0.02)


@pytest.fixture(scope="module")
def with_decoy(rig):
    """A ball of 0.3 m beside the target's, of which the scene does not say where it is in the end."""
    scene = make_scene(rig, world="blue", depth_m=DEPTH_M)
    decoy = Target(shape=Ball(radius_m=0.15), world_from_target=RigidTransform.identity())
    return FastRenderer(prepare(replace(scene, decoys=(decoy,)), rig, quality=LightQuality.coarse()))


def decoyed(rig, *, target_m, decoy_m):
    """State on an axis with target and decoy at distances along it."""
    q1, q2 = np.radians(ON_AXIS)
    target, decoy = (on_gaze(rig, q1=q1, q2=q2, distance_m=metres) for metres in (target_m, decoy_m))
    now = state(ON_AXIS, target)
    return replace(now, world_from_decoys=(RigidTransform.from_translation(now.world_from_body.apply(decoy)),))


def test_a_decoy_before_the_target_hides_it_and_is_no_target(rig, with_decoy):
    now = decoyed(rig, target_m=3.0, decoy_m=1.5)
    red = lambda frame: painted(frame, label=Label.DECOY)  # noqa: E731
    frame, row = row_of(rig, with_decoy, now, image=red)
    assert row["target_visible_px"] == 0
    assert row["cause_of_loss"] == "hidden by world"
    assert row["detected_thing"] == "decoy"
    instances = np.unique(frame.instance[frame.label == Label.DECOY])
    assert [with_decoy.instance_names[each] for each in instances] == ["decoy 0"]


def test_a_ball_of_triangles_looks_like_a_ball(rig, renderer, with_decoy):
    """The decoy in the target's place, 0.1 % of the radius inside it at most: of 33 px, 0.03.

    Pixels at its rim may fall to either side. The others have its radiance but for the flat faces' own shadow, which is
    ragged where the sun grazes the ball.
    """
    shape = Ball(radius_m=0.15)
    scene = replace(renderer.scene, target=Target(shape=shape, world_from_target=RigidTransform.identity()))
    exact = FastRenderer(prepare(scene, rig, quality=LightQuality.coarse()))
    now = decoyed(rig, target_m=40.0, decoy_m=1.5)
    found = with_decoy.render_states([now])[0]
    (decoy,) = now.world_from_decoys
    expected = exact.render_states([replace(now, world_from_target=decoy, world_from_decoys=None)])[0]
    on_decoy, on_ball = found.label == Label.DECOY, expected.label == Label.TARGET
    assert on_ball.sum() > 1000
    assert (on_decoy != on_ball).sum() < 0.01 * on_ball.sum()
    both = on_decoy & on_ball
    relative = np.abs(found.radiance[both] / expected.radiance[both] - 1)
    assert np.percentile(relative, 99) < 0.02
    np.testing.assert_allclose(found.radiance[both].mean(axis=0), expected.radiance[both].mean(axis=0), rtol=0.002)


@pytest.mark.parametrize("q_deg", [ON_AXIS, (-50.0, 15.0), (5.0, 30.0)])
@pytest.mark.parametrize("distance_m", [1.0, 4.0])
def test_full_size_is_that_of_the_exact_silhouette(rig, renderer, q_deg, distance_m):
    """Beside every pixel's ray against the unfolded ball.

    A count of n pixels is known to about the square root of its border, 3.5 sqrt(n) pixels long, so to
    2 sqrt(3.5 sqrt(n)) with certainty.
    """
    q1, q2 = np.radians(q_deg)
    place = on_gaze(rig, q1=q1, q2=q2, distance_m=distance_m)
    truth = GroundTruthColumns(rig, Ball(radius_m=RADIUS_M), any_red())
    centre, area, _ = truth._silhouette(np.array([q1, q2]), RigidTransform.from_translation(place))
    train = OpticalTrain.from_rig(rig, q1=q1, q2=q2)
    in_camera = camera_pose(rig.camera).inv().apply(place)
    exact = ball_silhouette(
        rig, train, centre_m=in_camera, radius_m=RADIUS_M, region=Region.GAZE, shape=renderer.shape
    ).sum()
    assert area == pytest.approx(exact, abs=2 * np.sqrt(3.5 * np.sqrt(exact)))
    assert centre == pytest.approx(train.project([in_camera]).pixels[0], abs=1e-6)


def test_true_pixel_is_the_exact_projection_in_the_crop(rig, renderer):
    q1, q2 = np.radians(ON_AXIS)
    place = np.add(on_gaze(rig, q1=q1, q2=q2, distance_m=2.0), [0.0, 0.1, 0.1])
    _, row = row_of(rig, renderer, state(ON_AXIS, place))
    pixel = OpticalTrain.from_rig(rig, q1=q1, q2=q2).project([camera_pose(rig.camera).inv().apply(place)]).pixels
    expected = Crop.of(ExactCorners(rig).corners([q1, q2])).from_image(pixel)[0]
    assert (row["true_x_px"], row["true_y_px"]) == pytest.approx(tuple(expected), abs=1e-6)


def test_a_mesh_of_a_ball_has_the_size_of_the_ball(rig):
    """The unit sphere of two subdivisions has an outline some 2 per cent smaller than its circle."""
    from scenes.light.materials import Material
    from scenes.stage.targets import MeshShape
    from scenes.surfaces.shapes import unit_sphere
    from scenes.surfaces.surface import surface

    vertices, faces = unit_sphere(3)
    mesh = MeshShape(name="sphere", surface=surface(RADIUS_M * vertices, faces, Material.TARGET))
    q = np.radians(ON_AXIS)
    pose = RigidTransform.from_translation(on_gaze(rig, q1=q[0], q2=q[1], distance_m=2.0))
    areas = [
        GroundTruthColumns(rig, shape, any_red())._silhouette(q, pose)[1] for shape in (mesh, Ball(radius_m=RADIUS_M))
    ]
    assert areas[0] == pytest.approx(areas[1], rel=0.03)


def test_a_fish_is_smaller_than_the_ball_that_holds_it(rig):
    q = np.radians(ON_AXIS)
    pose = RigidTransform.from_translation(on_gaze(rig, q1=q[0], q2=q[1], distance_m=2.0))
    fish = GroundTruthColumns(rig, target_named("fish"), any_red())._silhouette(q, pose)[1]
    around = GroundTruthColumns(rig, Ball(radius_m=0.155), any_red())._silhouette(q, pose)[1]
    assert 0.02 * around < fish < around


@pytest.mark.parametrize(
    ("q_deg", "target_m", "cause"),
    [
        (REAR, 2.0, "hidden by hull"),
        # A web of the bracket, which is open between its webs, hides a ball that is far away.
        (STEEP, 8.0, "hidden by mount"),
        (BESIDE, (2.0, 2.0, 0.0), "not in view"),
        # 60 m away a ball of 0.2 m is 2 px wide.
        (ON_AXIS, 60.0, "too small"),
    ],
)
def test_causes_by_where_things_are(rig, renderer, q_deg, target_m, cause):
    """The target is at a place, or at a distance along the axis."""
    q1, q2 = np.radians(q_deg)
    place = on_gaze(rig, q1=q1, q2=q2, distance_m=target_m) if isinstance(target_m, float) else np.array(target_m)
    _, row = row_of(rig, renderer, state(q_deg, place))
    assert row["cause_of_loss"] == cause


@pytest.mark.parametrize(("q_deg", "role"), [(REAR, Role.HULL), (STEEP, Role.MOUNT)])
def test_what_hides_the_target_stands_in_the_way_of_its_ray(rig, q_deg, role):
    """The poses above by another code: trimesh, and the exact train's ray from the gaze mirror to the ball."""
    q1, q2 = np.radians(q_deg)
    place = on_gaze(rig, q1=q1, q2=q2, distance_m=2.0)
    train, camera = OpticalTrain.from_rig(rig, q1=q1, q2=q2), camera_pose(rig.camera)
    ray = train.trace(train.project([camera.inv().apply(place)]).pixels)
    start, along = camera.apply(ray.origin_m[0]), camera.rotation.apply(ray.direction[0])
    layout = Layout.from_rig(rig)
    poses = {Group.PAN: layout.body_from_pan(q1), Group.TILT: layout.body_from_m2(q1, q2)}
    met = {}
    for part in rig_meshes(rig):
        vertices = poses[part.group].apply(part.vertices_m) if part.group in poses else part.vertices_m
        mesh = trimesh.Trimesh(vertices, part.faces, process=False)
        places, *_ = mesh.ray.intersects_location([start + 1e-4 * along], [along])
        for distance in (places - start) @ along:
            met[float(distance)] = part.role
    nearest = min(met)
    assert nearest < 2.0 - RADIUS_M
    assert met[nearest] is role


def test_place_in_the_crop_is_known_as_far_as_the_target_reaches_over_the_mirror(rig, renderer):
    """Turned away from it by pan: first its centre leaves the crop, then its edge, and then the place is nan."""
    place = on_gaze(rig, q1=np.radians(20.0), q2=np.radians(-5.0), distance_m=1.0)
    rows = [row_of(rig, renderer, state((pan, -5.0), place))[1] for pan in np.arange(20.0, 44.0, 2.0)]
    known = np.array([np.isfinite(row["true_x_px"]) for row in rows])
    visible = np.array([row["target_visible_px"] > 0 for row in rows])
    assert known[0]
    assert not known[-1]
    assert (known | ~visible).all()
    # What touches the edge with less than a pixel is not rendered: not at two poses, which are 16 px apart.
    assert (known & ~visible).sum() <= 1
    outside = [row["true_x_px"] for row in rows if np.isfinite(row["true_x_px"]) and not 0 <= row["true_x_px"] <= 320]
    assert outside
    # The ball is 0.2 m wide at 1 m, the mirror's 320 pixels of crop some 0.4 m: its centre is half of it outside.
    assert np.abs(np.array(outside) - 160).max() < 160 + 120


def test_causes_by_what_the_image_shows(rig, renderer):
    """The ball is there in all of them: white, dark, or of another colour."""
    q1, q2 = np.radians(ON_AXIS)
    now = state(ON_AXIS, on_gaze(rig, q1=q1, q2=q2, distance_m=2.0))
    for colour, cause in (((255, 255, 255), "saturated"), ((20, 2, 2), "too dark"), ((30, 200, 30), "colour")):
        _, row = row_of(rig, renderer, now, image=lambda frame, colour=colour: painted(frame, colour))
        assert row["cause_of_loss"] == cause
        clipped = row["detector_true_px"] if cause == "saturated" else 0
        # The crop mixes the pixels of its border, 3.5 times the square root of its area, with what is beside it.
        assert 76800 * row["saturated_fraction"] == pytest.approx(clipped, abs=3.5 * np.sqrt(row["detector_true_px"]))


def test_slewing_is_told_by_the_servos_speed(rig, renderer):
    """Out of view while the servo runs at its rate and the loop follows: outrun. A scan does not count."""
    place = on_gaze(rig, q1=np.radians(ON_AXIS[0]), q2=np.radians(ON_AXIS[1]), distance_m=2.0)
    now = state((ON_AXIS[0] + 20.0, ON_AXIS[1]), place)
    fast = np.radians([rig.gaze.servos.pan.speed_deg_per_s, 0.0])
    assert row_of(rig, renderer, now, speed=fast)[1]["cause_of_loss"] == "slewing"
    assert row_of(rig, renderer, now, speed=fast, mode=Mode.SCAN)[1]["cause_of_loss"] == "not in view"


def test_directions_are_in_the_body_frame(rig, renderer):
    """Closed form: from the centre of M2 to a point 45 degrees to the left of it, and 1 m above."""
    centre = Layout.from_rig(rig).body_from_gimbal.translation
    _, row = row_of(rig, renderer, state(ON_AXIS, np.add(centre, [1.0, 1.0, np.sqrt(2)])))
    assert row["true_azimuth_deg"] == pytest.approx(45.0)
    assert row["true_elevation_deg"] == pytest.approx(45.0)
    assert row["target_distance_m"] == pytest.approx(2.0)
