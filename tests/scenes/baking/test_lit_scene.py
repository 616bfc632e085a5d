"""Which light a scene is lit with."""

import pytest

from rigs import Rig
from scenes.baking import lit_scene
from scenes.baking.light_quality import LightQuality
from scenes.baking.lit_scene import prepare
from scenes.stage.scene import make_scene


class EnoughError(Exception):
    """Raised in place of lighting a world."""


def test_only_a_look_takes_full_light_for_a_draft(monkeypatch):
    """A dive in draft light that is gone on with shall not find full light in the cache meanwhile."""
    asked = []

    def lit_world(mesh, light, quality):
        asked.append(quality.name)
        raise EnoughError

    monkeypatch.setattr(lit_scene, "lit_world", lit_world)
    rig = Rig.load("bench")
    for look in (False, True):
        with pytest.raises(EnoughError):
            prepare(make_scene(rig), rig, [], quality=LightQuality.draft(), full_if_kept=look)
    assert asked == ["draft", "full"]
