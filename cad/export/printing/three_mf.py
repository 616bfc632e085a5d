"""3MF: meshes with names, colours and units, the same bytes for the same meshes.

Written by lib3mf, the 3MF consortium's own library. It dates the entries of its archive and draws the identifiers at
random: the identifiers are set from the names, and the archive is packed anew with one fixed date.
"""

from __future__ import annotations

import io
import uuid
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import lib3mf
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from cad.colours import colour
from optics.mesh import PartMesh, Role

NAMESPACE = uuid.uuid5(uuid.NAMESPACE_URL, "mirrorgaze/3mf")
ZIP_DATE = (2021, 1, 1, 0, 0, 0)
"""An entry of an archive must have a date; a fixed one keeps the file's bytes the same."""


@dataclass(frozen=True, kw_only=True)
class PlacedMesh:
    """A part's mesh and where it stands in the file's space.

    Attributes
    ----------
    mesh : PartMesh
    pose : RigidTransform
        From the mesh's frame to the file's, metres.
    """

    mesh: PartMesh
    pose: RigidTransform


def write_3mf(placed: Sequence[PlacedMesh], path: Path, *, title: str) -> Path:
    """Write parts in millimetres, each an object with its name and its role's colour."""
    library = lib3mf.get_wrapper()
    model = library.CreateModel()
    model.SetUnit(lib3mf.ModelUnit.MilliMeter)
    model.SetBuildUUID(_identifier(path.stem, "build"))
    metadata = model.GetMetaDataGroup()
    metadata.AddMetaData("", "Title", title, "xs:string", True)
    metadata.AddMetaData("", "Application", "mirrorgaze", "xs:string", True)
    materials = model.AddBaseMaterialGroup()
    material_of = {
        role: materials.AddMaterial(role.value, library.RGBAToColor(*colour(role), 255))
        for role in sorted({item.mesh.role for item in placed}, key=list(Role).index)
    }
    for item in placed:
        thing = model.AddMeshObject()
        thing.SetName(item.mesh.name)
        thing.SetPartNumber(item.mesh.name)
        thing.SetUUID(_identifier(path.stem, item.mesh.name))
        thing.SetGeometry(*_geometry(1000 * item.pose.apply(item.mesh.vertices_m), item.mesh.faces))
        thing.SetObjectLevelProperty(materials.GetResourceID(), material_of[item.mesh.role])
        built = model.AddBuildItem(thing, library.GetIdentityTransform())
        built.SetUUID(_identifier(path.stem, item.mesh.name, "place"))
        built.SetPartNumber(item.mesh.name)
    path.write_bytes(_packed_anew(bytes(model.QueryWriter("3mf").WriteToBuffer())))
    return path


def _identifier(*names: str) -> str:
    return str(uuid.uuid5(NAMESPACE, "/".join(names)))


def _geometry(vertices_mm: NDArray[np.float64], faces: NDArray[np.int32]) -> tuple[object, object]:
    """Vertices and triangles as lib3mf's arrays."""
    points = np.ascontiguousarray(vertices_mm, dtype=np.float32)
    corners = np.ascontiguousarray(faces, dtype=np.uint32)
    positions = (lib3mf.Position * len(points)).from_buffer_copy(points)
    triangles = (lib3mf.Triangle * len(corners)).from_buffer_copy(corners)
    return positions, triangles


def _packed_anew(archive: bytes) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(archive)) as source, zipfile.ZipFile(packed, "w") as target:
        for name in sorted(source.namelist()):
            entry = zipfile.ZipInfo(name, ZIP_DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            target.writestr(entry, source.read(name))
    return packed.getvalue()
