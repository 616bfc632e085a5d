"""Files that come with a package, found by name: rigs, dives."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Presets:
    """TOML files of one kind in one folder.

    Attributes
    ----------
    kind : str
        What they are, as a user calls it.
    folder : Path
    """

    kind: str
    folder: Path

    def names(self) -> list[str]:
        """Names, in alphabetical order."""
        return sorted(path.stem for path in self.folder.glob("*.toml"))

    def path(self, name: str) -> Path:
        """File of a preset; raises `FileNotFoundError` when there is none of that name."""
        names = self.names()
        if name not in names:
            close = difflib.get_close_matches(name, names, n=1)
            hint = f"; did you mean {close[0]!r}?" if close else ""
            raise FileNotFoundError(
                f"{self.kind} {name!r}: expected a preset ({', '.join(names)}) or a TOML file{hint}"
            )
        return self.folder / f"{name}.toml"

    def find(self, name_or_path: str | Path) -> Path:
        """File given by a preset's name or by its path; raises `FileNotFoundError` when there is neither."""
        path = Path(name_or_path)
        return path if path.is_file() else self.path(str(name_or_path))
