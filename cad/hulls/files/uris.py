"""Where the files are that a robot's description names: there is no ROS here that would know."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import unquote, urlparse

FOLDERS_ABOVE = 4
"""How far up a file is looked for without its package's name: copies of packages have other folders' names."""


def find_file(uri: str, description: Path) -> Path | None:
    """File that a description names, or None where it is not found.

    ``package://NAME/REST`` and ``model://NAME/REST`` are looked for as NAME/REST and REST in the description's folder
    and those above it, and last by the bare name beside the description. Anything else is a path, from the
    description's folder where it is not absolute.
    """
    parsed = urlparse(uri)
    folder = description.resolve().parent
    if parsed.scheme not in ("package", "model"):
        path = Path(unquote(parsed.path) if parsed.scheme == "file" else uri)
        candidates = [folder / path, folder / path.name]
    else:
        package, rest = unquote(parsed.netloc), unquote(parsed.path).lstrip("/")
        above = [folder, *folder.parents]
        candidates = [place / package / rest for place in above]
        candidates += [place / rest for place in above if place.name == package]
        candidates += [place / rest for place in above[: FOLDERS_ABOVE + 1]]
        candidates += [folder / Path(rest).name, folder / "meshes" / Path(rest).name]
    return next((path.resolve() for path in candidates if path.is_file()), None)
