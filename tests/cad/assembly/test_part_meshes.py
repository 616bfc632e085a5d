"""Meshes of single parts in the cache: what is in their keys, and that what is kept is what would be made."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from build123d import Solid

from cad.assembly import assembly as module
from cad.assembly.assembly import Part, kept_assembly
from cad.assembly.part_meshes import part_key
from optics.mesh import Group, Role
from rigs import Rig

LARGE = ("hull", "fold_bracket", "gimbal_base", "yoke", "mirror_holder")
WIDER_MM = 10.0
BOX = Part(name="box", group=Group.FIXED, role=Role.MOUNT, make=lambda: Solid.make_box(30, 20, 10))


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("MIRRORGAZE_CACHE", str(tmp_path))


@pytest.fixture
def planned(monkeypatch):
    """Function that gives the keys of a rig's large parts; nothing is made for them but boxes."""
    mesh = BOX.mesh
    monkeypatch.setattr(Part, "mesh", property(lambda part: mesh))
    monkeypatch.setattr(module, "fits_printer", lambda mesh, mount: True)

    def keys(rig: Rig) -> dict[str, str]:
        assembly = kept_assembly(rig)
        return {name: assembly.part(name).kept_as for name in LARGE}

    return keys


def changed(before: dict[str, str], after: dict[str, str]) -> set[str]:
    return {name for name in LARGE if before[name] != after[name]}


def test_a_part_is_made_again_when_what_shapes_it_changes(planned):
    rig = Rig.load("bluerov2")
    before = planned(rig)
    assert len(set(before.values())) == len(LARGE)
    assert planned(rig) == before
    mirror = rig.require_gaze().gaze_mirror
    wider = rig.with_(gaze_mirror__width_mm=mirror.width_mm + WIDER_MM)
    assert changed(before, planned(wider)) == {"yoke", "mirror_holder"}
    farther = rig.with_(gaze_mirror__distance_mm=mirror.distance_mm + 1)
    assert {"gimbal_base", "hull"} <= changed(before, planned(farther))
    assert changed(before, planned(rig.with_gaze(mount={"wall_mm": 4.0}))) == set(LARGE)


def test_the_key_is_of_all_that_is_in_a_value(aqua2):
    layout, mount = aqua2.layout, aqua2.rig.gaze.mount
    moved = replace(layout, body_from_m1=layout.body_from_gimbal)
    keys = [
        part_key("a", layout, mount),
        part_key("b", layout, mount),
        part_key("a", moved, mount),
        part_key("a", layout, mount.model_copy(update={"wall_mm": 9.0})),
        part_key("a", layout, (mount, 1.0)),
    ]
    assert len(set(keys)) == len(keys)
    with pytest.raises(TypeError, match="expected numbers"):
        part_key("a", object())


def test_what_is_kept_is_what_would_be_made(cache):
    kept = replace(BOX, kept_as=part_key("box", 30, 20, 10))
    for part in (kept, replace(kept, make=lambda: pytest.fail("made again"))):
        assert (part.mesh.name, part.mesh.group, part.mesh.role) == ("box", Group.FIXED, Role.MOUNT)
        np.testing.assert_array_equal(part.mesh.vertices_m, BOX.mesh.vertices_m)
        np.testing.assert_array_equal(part.mesh.faces, BOX.mesh.faces)
        assert part.mesh.faces.dtype == np.int32
