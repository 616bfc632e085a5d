"""Small hull files, made on the spot."""

from __future__ import annotations

import pytest
import trimesh

ONE_TRIANGLE_DAE = """<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><created>2021-01-01T00:00:00Z</created><modified>2021-01-01T00:00:00Z</modified>{asset}</asset>
  <library_geometries><geometry id="g" name="fin"><mesh>
    <source id="p"><float_array id="a" count="9">0 0 0 3 0 0 0 4 0</float_array>
      <technique_common><accessor source="#a" count="3" stride="3">
        <param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
      </accessor></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    <triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 {last}</p></triangles>
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene id="s"><node id="n"><translate>0 0 5</translate>
    <instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>
"""


@pytest.fixture
def write(tmp_path):
    """Write a file of text, bytes or triangles; return its path."""

    def written(name: str, content):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(content, trimesh.Trimesh):
            content.export(path)
        else:
            path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return written


@pytest.fixture
def one_triangle_dae(write):
    def written(asset: str = "", last: int = 2):
        return write("fin.dae", ONE_TRIANGLE_DAE.format(asset=asset, last=last))

    return written
