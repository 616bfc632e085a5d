"""The rig specification: what a mirror gaze is made of, typed, validated, with the units in the names."""

from rigs.camera import Camera, FisheyeSpec, PinholeSpec
from rigs.documents.problems import Problem, RigError
from rigs.files import load_document, preset_names, preset_path, preset_with_hull, save_document
from rigs.gaze import FlatMirror, FoldMirror, Gaze, GazeMirror
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
    Unit,
    Vehicle,
)
from rigs.port import DomePortSpec, FlatPortSpec, NoPortSpec, Port
from rigs.requirements import Requirements
from rigs.rig import Rig
from rigs.water import JerlovType, Water, WaterSource

__all__ = [
    "BoxHull",
    "Camera",
    "DomePortSpec",
    "FileHull",
    "FisheyeSpec",
    "FlatMirror",
    "FlatPortSpec",
    "FoldMirror",
    "Gaze",
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
    "Requirements",
    "Rig",
    "RigError",
    "Servo",
    "Servos",
    "TorpedoHull",
    "Unit",
    "Vehicle",
    "Water",
    "WaterSource",
    "load_document",
    "preset_names",
    "preset_path",
    "preset_with_hull",
    "save_document",
]
