"""The fragment shader does what the reader in NumPy does: its own text, statement by statement, in another language.

GLSL's statements that it uses are Python's but for types, braces and a few words; vectors and matrices are those of
NumPy, a matrix by its columns. A compiler sees it where one is installed.
"""

import re
import shutil
import subprocess

import numpy as np
import pytest

from optics.gaze import read_camera
from optics.gaze.camera_table import SHADER, camera_table
from rigs import Rig

SIZE = {"width_px": 48, "height_px": 36}

TYPES = "vec3|vec4|mat4|float|int|bool|ivec2|Ray|void"

WORDS = {"&&": " and ", "||": " or ", "!(": "not (", "!i": "not i", "!r": "not r", "true": "True", "false": "False"}


class Vector(np.ndarray):
    """With the names of its components."""

    x, y, z, w = (property(lambda self, k=k: float(self[k])) for k in range(4))
    xyz = property(lambda self: self[:3])


def vector(*values):
    return np.hstack([np.asarray(value, dtype=float) for value in values]).view(Vector)


class Matrix:
    """By columns, as GLSL has it."""

    def __init__(self, *values):
        self.columns = np.reshape(values, (4, 4)).astype(float)

    def __getitem__(self, column):
        return self.columns[column].view(Vector)

    def __mul__(self, other):
        return Matrix((self.columns.T @ other.columns.T).T)


class Ray:
    def __init__(self, origin, direction, path, blocked):
        self.origin, self.direction, self.path, self.blocked = origin, direction, path, blocked


def in_python(text):
    """GLSL's functions as Python's."""
    text = re.sub(r"//.*", "", text)
    text = text[text.index("mat4 gaze_mirror_pose") :]
    for word, other in WORDS.items():
        text = text.replace(word, other)
    text = re.sub(
        rf"^(?:{TYPES}) (\w+)\((.*)\) {{", lambda m: f"def {m[1]}({untyped(m[2])}):", text, flags=re.MULTILINE
    )
    text = re.sub(r"if \((.*)\) {", r"if (\1):", text)
    text = re.sub(rf"^( +)(?:{TYPES}) (\w+) =", r"\1\2 =", text, flags=re.MULTILINE)
    return text.replace("}", "").replace(";", "")


def untyped(parameters):
    return ", ".join(each.split()[-1] for each in parameters.split(",") if each)


def shader(table, q1, q2):
    """Names of the shader, with its uniforms set."""
    layers = {"origin": table["origin_m"], "direction": table["direction"], "status": table["status"][..., np.newaxis]}
    names = {name: Matrix(*table[name].T.ravel()) for name in ("body_from_m1", "body_from_gimbal")}
    names |= {name: vector(table[name]) for name in ("m1_outline", "m2_outline", "pan", "tilt")}
    names |= {name: name for name in layers} | {"q1": q1, "q2": q2, "Ray": Ray, "mat4": Matrix, "ivec2": vector}
    names |= {"sin": np.sin, "cos": np.cos, "abs": abs, "dot": np.dot, "vec4": vector, "normalize": np.asarray}
    names["reflect"] = lambda d, n: d - 2 * np.dot(n, d) * n
    names["texelFetch"] = lambda layer, texel, level: vector(layers[layer][int(texel.y), int(texel.x)])
    exec(in_python(SHADER.read_text()), names)  # the text is ours
    return names


@pytest.mark.parametrize(("name", "outline"), [("aqua2", "octagon"), ("bluerov2", "ellipse")])
def test_the_shader_sees_what_the_reader_sees(name, outline):
    rig = Rig.load(name).with_(gaze_mirror__outline=outline)
    table = camera_table(rig, **SIZE)
    q1, q2 = (0.6 * np.array([rig.gaze.joints.pan.limits[1], rig.gaze.joints.tilt.limits[0]])).tolist()
    origin, direction, path, blocked = read_camera.rays(table, q1, q2)
    names = shader(table, q1, q2)
    with np.errstate(divide="ignore", invalid="ignore"):
        for row, column in np.ndindex(path.shape):
            ray = names["ray_at"](vector(column, row))
            assert (ray.path, ray.blocked) == (path[row, column], blocked[row, column])
            np.testing.assert_allclose(ray.origin, origin[row, column], atol=1e-9)
            np.testing.assert_allclose(ray.direction, direction[row, column], atol=1e-9)
    assert set(np.unique(path)) >= {1, 2, 3}


def test_a_compiler_takes_it(tmp_path):
    compiler = shutil.which("glslangValidator")
    if compiler is None:
        pytest.skip("there is no glslangValidator on PATH: apt-get install glslang-tools")
    for version in ("#version 330 core", "#version 300 es\nprecision highp float;"):
        file = tmp_path / "camera.frag"
        file.write_text(SHADER.read_text().replace("#version 330 core", version))
        assert subprocess.run([compiler, str(file)], check=False).returncode == 0
