"""Catalogue of servos a rig may name."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

SERVO_CATALOGUE: dict[str, dict[str, Any]] = tomllib.loads(
    (Path(__file__).parent / "data" / "servos.toml").read_text(encoding="utf-8")
)


def servo_numbers(name: str) -> dict[str, Any]:
    """Numbers of a catalogue servo, with its name."""
    return {"name": name, **SERVO_CATALOGUE[name]}
