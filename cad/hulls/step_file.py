"""A hull from a STEP file of one solid: the solid, and the flat faces that have names in the file."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
from build123d import Face, GeomType, Solid
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.Interface import Interface_Static
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_ChildIterator
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.XCAFDoc import XCAFDoc_DocumentTool

from cad.hulls.files.step import step_shape, without_messages
from cad.hulls.files.units import check_size
from cad.hulls.hull_mesh import body_from_file
from cad.shapes import location_mm, one_solid
from rigs import FileHull

Plane = tuple[tuple[float, float, float], tuple[float, float, float]]
"""Point in millimetres and outward normal."""
FACE_NAMES = "read.stepcaf.subshapes.name"


def step_solid(hull: FileHull) -> Solid:
    """Solid of a STEP file in the body frame, millimetres; raises `ValueError` when it is no hull."""
    try:
        solid = one_solid(step_shape(hull.file), "the file", "a hull of several is read as triangles")
        check_size(np.array(tuple(solid.bounding_box().size)), None)
    except ValueError as error:
        raise ValueError(f"hull.file = {hull.file.name!r}: {error}") from None
    return location_mm(body_from_file(hull)) * solid


def step_planes(hull: FileHull) -> dict[str, Plane]:
    """Flat faces with a name: the middle of each and its outward normal, body frame."""
    place = location_mm(body_from_file(hull))
    return {name: _plane(place * face) for name, face in _named_faces(hull.file, hull.file.stat().st_mtime_ns)}


@lru_cache(maxsize=1)
def _named_faces(file: Path, changed_ns: int) -> tuple[tuple[str, Face], ...]:
    document = TDocStd_Document(TCollection_ExtendedString(file.name))
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    before = Interface_Static.IVal_s(FACE_NAMES)
    Interface_Static.SetIVal_s(FACE_NAMES, 1)
    try:
        with without_messages():
            read = reader.ReadFile(str(file)) == IFSelect_ReturnStatus.IFSelect_RetDone and reader.Transfer(document)
        if not read:
            raise ValueError(f"hull.file = {file.name!r}: expected a STEP file, got what cannot be read as one")
    finally:
        Interface_Static.SetIVal_s(FACE_NAMES, before)
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    labels = TDF_ChildIterator(shapes.Label(), True)
    faces = []
    while labels.More():
        name, shape = TDataStd_Name(), shapes.GetShape_s(labels.Value())
        if labels.Value().FindAttribute(TDataStd_Name.GetID_s(), name) and not shape.IsNull():
            text = name.Get().ToExtString()
            if text and shape.ShapeType() == TopAbs_ShapeEnum.TopAbs_FACE:
                faces.append((text, Face(shape)))
        labels.Next()
    return tuple((text, face) for text, face in faces if face.geom_type == GeomType.PLANE)


def _plane(face: Face) -> Plane:
    centre, normal = tuple(face.center()), tuple(face.normal_at())
    return (centre[0], centre[1], centre[2]), (normal[0], normal[1], normal[2])
