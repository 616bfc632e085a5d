"""YAML files of other programs: Kalibr's, ROS's, and OpenCV's with its own header and tag."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import yaml

from optics.kernels.tables import read_text

HEADER = re.compile(r"\A\ufeff?%YAML[^\n]*\n")
"""OpenCV writes a colon that YAML does not know."""


class _Loader(yaml.SafeLoader):  # type: ignore[misc]  # PyYAML has no types
    """Plain values only; a matrix of OpenCV is a mapping of rows, cols, dt and data."""


_Loader.add_constructor(
    "tag:yaml.org,2002:opencv-matrix", lambda loader, node: loader.construct_mapping(node, deep=True)
)


def read_yaml(path: Path) -> dict[str, Any]:
    """Mapping of a YAML file; a `ValueError` for anything else."""
    try:
        content = yaml.load(HEADER.sub("", read_text(path)), _Loader)
    except (yaml.YAMLError, RecursionError) as error:
        place = str(error).replace("\n", " ")
        raise ValueError(f"{path}: expected YAML, got {place}") from None
    if not isinstance(content, dict):
        raise ValueError(f"{path}: expected keys with values in YAML, got {type(content).__name__}")
    return content
