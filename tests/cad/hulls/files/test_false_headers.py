"""Hull files whose header claims more than the file holds are refused in a moment, without the memory they ask for."""

from __future__ import annotations

import json
import struct

import pytest

from cad.hulls.files.triangles import read_hull_file

MANY = 4_000_000_000
PLY = (
    f"ply\nformat {{}} 1.0\nelement vertex {MANY}\nproperty float x\nproperty float y\nproperty float z\n"
    f"element face {MANY}\nproperty list uchar int vertex_indices\nend_header\n"
)
OUT_OF_RANGE = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
3 0 1 9
"""


def glb(document: dict[str, object]) -> bytes:
    text = json.dumps({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], **document}).encode()
    text += b" " * (-len(text) % 4)
    return b"glTF" + struct.pack("<III", 2, len(text) + 20, len(text)) + b"JSON" + text


ACCESSOR = {"componentType": 5126, "count": 10**11, "type": "VEC3"}
MESH = {"meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "nodes": [{"mesh": 0}]}
VIEW = {"buffers": [{"byteLength": 10**12}], "bufferViews": [{"buffer": 0, "byteLength": 10**12}]}

FILES = {
    "binary.ply": PLY.format("binary_little_endian").encode() + bytes(100),
    "text.ply": PLY.format("ascii").encode() + b"0 0 0\n",
    "index.ply": OUT_OF_RANGE.encode(),
    "binary.stl": bytes(80) + struct.pack("<I", MANY) + bytes(50),
    "accessor.glb": glb({"accessors": [ACCESSOR], **MESH}),
    "view.glb": glb({"accessors": [{"bufferView": 0, **ACCESSOR}], **VIEW, **MESH}),
    "flat.obj": b"v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n",
    "garbage.step": bytes(range(256)),
}


@pytest.mark.parametrize("name", FILES)
def test_a_file_that_claims_more_than_it_holds_is_refused(tmp_path, name):
    (tmp_path / name).write_bytes(FILES[name])
    with pytest.raises(ValueError, match=rf"{name}: expected "):
        read_hull_file(tmp_path / name)
