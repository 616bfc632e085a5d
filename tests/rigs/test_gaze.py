"""The gaze of a rig: one section in Python, six tables at the top of the file, all of them or none."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from rigs import BoxHull, Rig, preset_names
from rigs.documents.validation import validated

AQUA2 = Rig.load("aqua2")
TABLES = ["fold_mirror", "gaze_mirror", "joints", "servos", "hull", "mount"]


@pytest.mark.parametrize("name", preset_names())
def test_a_rig_is_written_as_its_file_is(name):
    rig = Rig.load(name)
    document = rig.model_dump()
    assert "gaze" not in document
    assert list(document)[7:13] == TABLES
    assert {key for key in TABLES if document[key] is None} == (set(TABLES) if name == "bench" else set())
    assert Rig.model_validate(document) == rig
    assert Rig.model_validate_json(rig.model_dump_json(exclude_none=True)) == rig


def test_a_gaze_can_be_given_whole():
    bench = Rig.load("bench")
    assert Rig(name="made", camera=bench.camera, port=bench.port, gaze=AQUA2.gaze).gaze == AQUA2.gaze
    assert Rig.model_validate(dict(AQUA2)) == AQUA2


def test_the_file_has_no_table_of_that_name():
    document = Rig.load("bench").model_dump(exclude_none=True)
    for tables in ({}, AQUA2.gaze.model_dump()):
        _, problems = validated(Rig, document | tables | {"gaze": {"hull": {}}})
        assert [problem.place for problem in problems] == ["gaze"]
        assert problems[0].expected.startswith("one of the known keys camera, description, fold_mirror, ")


def test_the_schema_says_that_the_tables_come_together():
    schema = Rig.model_json_schema()
    assert "gaze" not in schema["properties"] and "Gaze" not in schema["$defs"]
    assert list(schema["properties"])[7:13] == TABLES
    assert schema["dependentRequired"]["hull"] == ["fold_mirror", "gaze_mirror", "joints", "servos", "mount"]
    assert not set(schema["required"]) & set(TABLES)


def test_tables_and_values_are_replaced():
    hull = BoxHull(shape="box", length_mm=500, width_mm=300, height_mm=100)
    changed = AQUA2.with_gaze(hull=hull, mount={"wall_mm": 5.0})
    assert changed.gaze.hull == hull
    assert changed.gaze.mount == AQUA2.gaze.mount.model_copy(update={"wall_mm": 5.0})
    assert changed.gaze.fold_mirror is AQUA2.gaze.fold_mirror
    with pytest.raises(ValidationError, match="Extra inputs are not permitted"):
        AQUA2.with_gaze(port=AQUA2.port)


def test_who_needs_mirrors_is_told_which_rig_has_none():
    assert AQUA2.require_gaze() is AQUA2.gaze
    with pytest.raises(
        ValueError, match=r"^expected a rig with mirrors, got 'aqua2', which has none: .* fold_mirror, .* and mount$"
    ):
        AQUA2.without_mirrors().require_gaze()
