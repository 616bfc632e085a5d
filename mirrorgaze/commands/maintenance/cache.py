"""The cache: what is kept of what takes long to compute."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from mirrorgaze.options import JsonOption
from mirrorgaze.output import print_json, print_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from optics.kernels.cache_contents import KeptKind

UNITS_S = (("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0), ("seconds", 1.0))


def cache(
    kind: Annotated[str | None, typer.Argument(metavar="KIND", help="Kind of results to remove, with --clear.")] = None,
    clear: Annotated[bool, typer.Option("--clear", help="Remove all results, or those of one kind.")] = False,
    json: JsonOption = False,
) -> None:
    """List or remove the results that are kept on disk.

    Lists number, size and age of what takes long to compute, by kind: meshes, radiance fields, the light of worlds. The
    folder is $MIRRORGAZE_CACHE, or mirrorgaze in the user's cache folder. When it holds more than
    $MIRRORGAZE_CACHE_LIMIT_GB (5 GB unless set), the least recently used results are removed.

    \b
    Example:
      mirrorgaze cache
      mirrorgaze cache --clear rig-meshes
    """
    from dataclasses import asdict

    from optics.kernels.cache_contents import cache_folder, clear_cache, kept_kinds, limit_bytes

    if kind is not None and not clear:
        raise ValueError(f"expected --clear with a kind, got {kind!r} alone")
    limit, folder = limit_bytes(), str(cache_folder())
    removed = clear_cache(kind) if clear else []
    kinds, freed = kept_kinds(), sum(entry.bytes for entry in removed)
    if json:
        gone = {"removed": len(removed), "removed_bytes": freed}
        print_json({"folder": folder, "limit_bytes": limit, **gone, "kinds": [asdict(each) for each in kinds]})
        return
    if clear:
        typer.echo(f"removed {len(removed)} results, {_megabytes(freed)}")
    kept = sum(each.bytes for each in kinds)
    typer.echo(f"{folder}: {_megabytes(kept)} of at most {_megabytes(limit)}")
    _print_kinds(kinds)


def _print_kinds(kinds: Sequence[KeptKind]) -> None:
    if kinds:
        rows = [(each.kind, str(each.entries), _megabytes(each.bytes), each.oldest_s, each.unused_s) for each in kinds]
        lines = [(*words, _age(oldest), f"{_age(unused)} ago") for *words, oldest, unused in rows]
        print_table([("kind", "results", "size", "oldest", "last used"), *lines])


def _megabytes(count: float) -> str:
    return f"{count / 1e6:,.1f} MB"


def _age(seconds: float) -> str:
    unit, length = next((each for each in UNITS_S if seconds >= 2 * each[1]), UNITS_S[-1])
    return f"{seconds / length:.0f} {unit}"
