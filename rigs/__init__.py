"""The rig specification: what a mirror gaze is made of, typed, validated, with the units in the names."""

from rigs.files import load_document, preset_names, preset_path, preset_with_hull, save_document
from rigs.image_sensor import ImageSensorSpec
from rigs.lamps import Lamp
from rigs.mounting import (
    BoxHull,
    FileHull,
    Hull,
    HullPlane,
    Joint,
    Joints,
    Mount,
    OpenFrameHull,
    ParametricHull,
    Servo,
    Servos,
    TorpedoHull,
    Vehicle,
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
)
from rigs.water import JerlovType, Water, WaterSource

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
    "ImageSensorSpec",
    "JerlovType",
    "Joint",
    "Joints",
    "Lamp",
    "Mount",
    "NoPortSpec",
    "OpenFrameHull",
    "ParametricHull",
    "PinholeSpec",
    "Port",
    "Problem",
    "Rig",
    "RigError",
    "Servo",
    "Servos",
    "TorpedoHull",
    "Vehicle",
    "Water",
    "WaterSource",
    "load_document",
    "preset_names",
    "preset_path",
    "preset_with_hull",
    "save_document",
]
