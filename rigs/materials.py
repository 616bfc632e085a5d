"""Materials that mounts are made of."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, kw_only=True)
class Material:
    """Density and stiffness of a material."""

    density_kg_per_m3: float
    youngs_modulus_pa: float


MATERIALS: dict[str, Material] = {
    name: Material(**numbers)
    for name, numbers in tomllib.loads(
        (Path(__file__).parent / "data" / "materials.toml").read_text(encoding="utf-8")
    ).items()
}
