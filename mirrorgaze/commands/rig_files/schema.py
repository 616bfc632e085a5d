"""The format of rig files, for editors."""

from __future__ import annotations

from mirrorgaze.output import print_json


def schema() -> None:
    """Print the JSON Schema of rig files.

    An editor that knows the schema completes and checks rig files while you type.

    \b
    Example:
      mirrorgaze schema > rig.schema.json
    """
    from rigs import Rig

    print_json(Rig.model_json_schema())
