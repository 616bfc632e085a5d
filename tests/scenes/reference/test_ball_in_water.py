"""A ball in water beside the reference: what it hides from the water before it."""

from dataclasses import replace

import numpy as np
import pytest

from rigs import Rig
from scenes.baking.lit_scene import prepare
from scenes.light.waves import Wind
from scenes.reference.render import render_reference
from scenes.renderer import FastRenderer
from scenes.stage.scene import ball, make_scene

DEPTH_M, DISTANCE_M, RADIUS_M, PITCH_DEG = 5.0, 2.0, 0.3, -20.0
SIZE = {"width_px": 6, "height_px": 6}
PIXEL_PX = 120
"""Side of a pixel in the camera's own. What is around the ball is left out: the reference would follow paths to it."""


@pytest.mark.slow
def test_a_ball_hides_as_much_light_as_paths_say():
    """Rationale: seen from 2 m in type III a third of what the water scatters would come from straight behind the ball.

    Expected: overcast, on the mean over the ball within 6 % by channel: it is 1 to 3 % too bright in red, where its
    own light counts, and 4 to 5 % too dark in green and blue. Were the light behind it as strong as the water's mean,
    it would be 20 and 24 % too dark there.
    """
    rig = Rig.load("bench")
    whole, side_px = rig.camera, SIZE["width_px"] * PIXEL_PX
    narrow = {"fx_px": 4 * whole.fx_px, "fy_px": 4 * whole.fy_px, "width_px": side_px, "height_px": side_px}
    narrow |= {"cx_px": whole.cx_px - (whole.width_px - side_px) / 2}
    narrow |= {"cy_px": whole.cy_px - (whole.height_px - side_px) / 2}
    camera = whole.model_copy(update={"pitch_deg": PITCH_DEG, "position_mm": (0.0, 0.0, 0.0), **narrow})
    rig = rig.model_copy(update={"camera": camera})
    way = DISTANCE_M * np.array([np.cos(np.radians(PITCH_DEG)), 0.0, np.sin(np.radians(PITCH_DEG))])
    scene = make_scene(rig, world="blue", depth_m=DEPTH_M, jerlov_type="III", cloud=1.0, wind=Wind(speed_m_per_s=0.0))
    scene = replace(scene, target=ball(way - [0.0, 0.0, DEPTH_M], RADIUS_M))
    fast = FastRenderer(prepare(scene, rig, []), **SIZE, samples=16).render()
    true = render_reference(rig, [], scene, **SIZE, samples=2**13)
    on_ball = fast.target_fraction == 1
    assert on_ball.sum() > 20
    np.testing.assert_allclose(*(frame.radiance[on_ball].mean(axis=0) for frame in (fast, true)), rtol=0.06)
