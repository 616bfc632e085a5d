"""Reads a STEP file with OpenCascade; run by its path, in a process of its own, which a damaged file may end.

OpenCascade ends its process, without an exception, on one in twenty-five damaged files, and not each time that it reads
the same one. What is left in the folder that it is given is therefore numbers and one valid solid, no file to read
again.
"""

import sys
from pathlib import Path

import numpy as np
from OCP.BinTools import BinTools
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher
from OCP.GeomAbs import GeomAbs_SurfaceType
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.Interface import Interface_Static
from OCP.Message import Message
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_ChildIterator
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Shape
from OCP.XCAFDoc import XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

ANGULAR_TOLERANCE_RAD = 0.1
"""Between neighbours of a curved face's triangles, as build123d has it."""

Point = tuple[float, float, float]
FACES_HAVE_NAMES = "read.stepcaf.subshapes.name"


def main(file: str, folder: str, tolerance_mm: float) -> str:
    """Leave `triangles.npz`, and `solid.brep` where the file is one solid, closed and valid; say what is wrong.

    The arrays are `vertices` (n, 3) and `faces` (m, 3), with `corners` and `triangles`, the numbers of each that a
    solid or a face that bounds none has; and `names`, `points` and `normals` of the flat faces with a name, (k, 3).
    """
    messenger = Message.DefaultMessenger_s()
    for printer in list(messenger.Printers()):
        messenger.RemovePrinter(printer)
    # The shapes live as long as their document.
    document = TDocStd_Document(TCollection_ExtendedString("XCAF"))
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    shape = shapes.GetOneShape() if _read(file, document) else TopoDS_Shape()
    faces = [] if shape.IsNull() else _all(shape, TopAbs_ShapeEnum.TopAbs_FACE)
    if not faces:
        return "expected a STEP file with solids or faces, got none"
    solids = _all(shape, TopAbs_ShapeEnum.TopAbs_SOLID)
    alone = len(solids) == 1 and len(_all(solids[0], TopAbs_ShapeEnum.TopAbs_FACE)) == len(faces)
    if alone and _is_sound(solids[0]):
        BinTools.Write_s(solids[0], str(Path(folder) / "solid.brep"))
    bounding = IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    for solid in solids:
        TopExp.MapShapes_s(solid, TopAbs_ShapeEnum.TopAbs_FACE, bounding)
    pieces = [_triangles(piece, tolerance_mm) for piece in (*solids, *(f for f in faces if not bounding.Contains(f)))]
    if None in pieces:
        return "expected a STEP file, got one with a face that has no triangles"
    vertices, triangles = zip(*pieces, strict=True)
    names, points, normals = _named_planes(shapes)
    np.savez(
        Path(folder) / "triangles.npz",
        vertices=np.concatenate(vertices),
        faces=np.concatenate(triangles),
        corners=[len(piece) for piece in vertices],
        triangles=[len(piece) for piece in triangles],
        names=np.array(names, dtype=str),
        points=np.array(points, dtype=float).reshape(-1, 3),
        normals=np.array(normals, dtype=float).reshape(-1, 3),
    )
    return ""


def _read(file: str, document: TDocStd_Document) -> bool:
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    Interface_Static.SetIVal_s(FACES_HAVE_NAMES, 1)
    return bool(reader.ReadFile(file) == IFSelect_ReturnStatus.IFSelect_RetDone and reader.Transfer(document))


def _all(shape: TopoDS_Shape, kind: TopAbs_ShapeEnum) -> list[TopoDS_Shape]:
    """Each solid or face once, however many shells or solids share it."""
    found = IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    TopExp.MapShapes_s(shape, kind, found)
    return [found.FindKey(index) for index in range(1, found.Extent() + 1)]


def _is_sound(solid: TopoDS_Shape) -> bool:
    closed = all(BRep_Tool.IsClosed_s(shell) for shell in _all(solid, TopAbs_ShapeEnum.TopAbs_SHELL))
    return closed and BRepCheck_Analyzer(solid).IsValid()


def _triangles(shape: TopoDS_Shape, tolerance_mm: float) -> tuple[np.ndarray, np.ndarray] | None:
    """Corners and triangles, turned outwards; None when a face has none."""
    BRepMesh_IncrementalMesh(shape, tolerance_mm, True, ANGULAR_TOLERANCE_RAD, True)
    vertices: list[Point] = []
    triangles: list[list[int]] = []
    explorer = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
    while explorer.More():
        face, place = TopoDS.Face(explorer.Current()), TopLoc_Location()
        found = BRep_Tool.Triangulation_s(face, place)
        if found is None:
            return None
        start, moved = len(vertices), place.Transformation()
        nodes = [found.Node(index).Transformed(moved) for index in range(1, found.NbNodes() + 1)]
        vertices += [(node.X(), node.Y(), node.Z()) for node in nodes]
        order = (1, 3, 2) if face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED else (1, 2, 3)
        triangles += [[start + triangle.Value(corner) - 1 for corner in order] for triangle in found.Triangles()]
        explorer.Next()
    return np.array(vertices, dtype=float).reshape(-1, 3), np.array(triangles, dtype=np.int64).reshape(-1, 3)


def _named_planes(shapes: XCAFDoc_ShapeTool) -> tuple[list[str], list[Point], list[Point]]:
    """Names, middles and outward normals of the flat faces with a name."""
    names, points, normals = [], [], []
    labels = TDF_ChildIterator(shapes.Label(), True)
    while labels.More():
        name, shape = TDataStd_Name(), shapes.GetShape_s(labels.Value())
        named = labels.Value().FindAttribute(TDataStd_Name.GetID_s(), name) and name.Get().ToExtString()
        labels.Next()
        if not named or shape.IsNull() or shape.ShapeType() != TopAbs_ShapeEnum.TopAbs_FACE:
            continue
        face = TopoDS.Face(shape)
        surface = BRepAdaptor_Surface(face)
        if surface.GetType() != GeomAbs_SurfaceType.GeomAbs_Plane:
            continue
        axes = surface.Plane().Position()
        normal = axes.XDirection().Crossed(axes.YDirection())
        sign = -1 if face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED else 1
        properties = GProp_GProps()
        BRepGProp.SurfaceProperties_s(face, properties)
        middle = properties.CentreOfMass()
        names.append(named)
        points.append((middle.X(), middle.Y(), middle.Z()))
        normals.append((sign * normal.X(), sign * normal.Y(), sign * normal.Z()))
    return names, points, normals


if __name__ == "__main__":
    problem = main(sys.argv[1], sys.argv[2], float(sys.argv[3]))
    if problem:
        sys.exit(problem)
