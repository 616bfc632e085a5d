"""What a rig may name, with its numbers: servos, and materials that mounts are made of."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

DATA = Path(__file__).parent / "data"

SERVO_CATALOGUE: dict[str, dict[str, Any]] = tomllib.loads((DATA / "servos.toml").read_text(encoding="utf-8"))


def servo_numbers(name: str) -> dict[str, Any]:
    """Numbers of a catalogue servo, with its name."""
    return {"name": name, **SERVO_CATALOGUE[name]}


@dataclass(frozen=True, kw_only=True)
class Material:
    """Density and stiffness of a material."""

    density_kg_per_m3: float
    youngs_modulus_pa: float


MATERIALS: dict[str, Material] = {
    name: Material(**numbers)
    for name, numbers in tomllib.loads((DATA / "materials.toml").read_text(encoding="utf-8")).items()
}
