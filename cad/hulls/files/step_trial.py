"""Reads a STEP file and makes its triangles, for nothing: run by its path, in a process of its own.

OpenCascade ends its process, without an exception, on one in twenty-five damaged files; this one may.
"""

import sys

from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.Message import Message
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDocStd import TDocStd_Document
from OCP.XCAFDoc import XCAFDoc_DocumentTool


def main(file: str, tolerance_mm: float) -> None:
    """Read a file as `build123d.import_step` does, and mesh what is in it."""
    messenger = Message.DefaultMessenger_s()
    for printer in list(messenger.Printers()):
        messenger.RemovePrinter(printer)
    document = TDocStd_Document(TCollection_ExtendedString("XCAF"))
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    reader.SetColorMode(True)
    reader.SetLayerMode(True)
    reader.ReadFile(file)
    reader.Transfer(document)
    BRepMesh_IncrementalMesh(XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetOneShape(), tolerance_mm)


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
