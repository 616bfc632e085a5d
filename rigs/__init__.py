"""The rig specification: what a mirror gaze is made of, typed, validated, with the units in the names."""

from rigs.files import load_document, preset_names, preset_path, save_document
from rigs.mounting import (
    BoxHull,
    FileHull,
    Hull,
    HullPlane,
    Joint,
    Joints,
    Mount,
    OpenFrameHull,
    Servo,
    Servos,
)
from rigs.problems import Problem, RigError
from rigs.specification import (
    Camera,
    DomePortSpec,
    FisheyeSpec,
    FlatPortSpec,
    FoldMirror,
    GazeMirror,
    NoPortSpec,
    PinholeSpec,
    Port,
    Rig,
    Water,
)

__all__ = [
    "BoxHull",
    "Camera",
    "DomePortSpec",
    "FileHull",
    "FisheyeSpec",
    "FlatPortSpec",
    "FoldMirror",
    "GazeMirror",
    "Hull",
    "HullPlane",
    "Joint",
    "Joints",
    "Mount",
    "NoPortSpec",
    "OpenFrameHull",
    "PinholeSpec",
    "Port",
    "Problem",
    "Rig",
    "RigError",
    "Servo",
    "Servos",
    "Water",
    "load_document",
    "preset_names",
    "preset_path",
    "save_document",
]
