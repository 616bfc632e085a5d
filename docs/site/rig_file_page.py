"""The reference of the rig file, from its JSON Schema."""

from __future__ import annotations

from pathlib import Path
from typing import Any

Schema = dict[str, Any]

LIMITS = (
    ("minimum", "≥ {}"),
    ("exclusiveMinimum", "> {}"),
    ("maximum", "≤ {}"),
    ("exclusiveMaximum", "< {}"),
    ("minLength", "at least {} characters"),
    ("maxLength", "at most {} characters"),
    ("minItems", "at least {}"),
    ("maxItems", "at most {}"),
)

INTRODUCTION = """# The rig file

A rig file is TOML. Each table below is a section of it, generated from the schema that `mirrorgaze schema` prints.
`mirrorgaze new my-auv --from aqua2` writes a commented file to begin with, and `mirrorgaze check` says all that is
wrong with one. Lengths are millimetres and angles degrees, as the names say; frames and signs are those of
[conventions](conventions.md). The preset at the end explains its keys one by one.
"""


def write_rig_file_page(schema: Schema, preset: Path, target: Path) -> None:
    """Write the page for the schema of `rigs.Rig`, and a preset that shows it in use."""
    target.parent.mkdir(parents=True, exist_ok=True)
    example = f"## The preset `{preset.stem}`\n\n```toml\n{preset.read_text(encoding='utf-8')}```\n"
    target.write_text(f"{rig_file_page(schema)}\n{example}", encoding="utf-8")


def rig_file_page(schema: Schema) -> str:
    """The schema as Markdown: the top level, then each section with its variants."""
    definitions = schema["$defs"]
    parts = [INTRODUCTION, "## Top level\n\n" + _table({**schema, "required": schema.get("required", [])})]
    for key, value in schema["properties"].items():
        parts += _sections(f"[{key}]", value, definitions)
    return "\n\n".join(parts) + "\n"


def _sections(path: str, value: Schema, definitions: dict[str, Schema]) -> list[str]:
    """A section and those below it; a section of several shapes is documented shape by shape."""
    if value.get("type") == "array" and (names := _references(value["items"])):
        path = f"[{path}]"
    elif not (names := _references(value)):
        names = _references(value.get("additionalProperties") or {}) if isinstance(value, dict) else []
        path = path[:-1] + ".NAME]"
    found = []
    for name in names:
        section = definitions[name]
        kinds = [f'{k} = "{v["const"]}"' for k, v in section["properties"].items() if "const" in v]
        heading = f"## `{path}`" + (f" with `{kinds[0]}`" if kinds else "")
        found.append("\n\n".join([heading, section.get("description", ""), _table(section)]))
        for key, below in section["properties"].items():
            if _is_section(below):
                found += _sections(f"{path.rstrip(']')}.{key}]", below, definitions)
    return found


def _is_section(value: Schema) -> bool:
    extra = value.get("additionalProperties")
    below = [value, value.get("items") or {}, extra if isinstance(extra, dict) else {}]
    return any(_references(one) for one in below)


def _references(value: Schema) -> list[str]:
    """Names of the definitions that a value may be."""
    choices = [value, *value.get("anyOf", ()), *value.get("oneOf", ())]
    return [choice["$ref"].rpartition("/")[2] for choice in choices if "$ref" in choice]


def _table(section: Schema) -> str:
    required = section.get("required", ())
    rows = []
    for key, value in section["properties"].items():
        if _is_section(value):
            kind, default = "section", "required" if key in required else ""
        else:
            kind = _kind(value)
            default = "required" if key in required else _default(value)
        rows.append((f"`{key}`", kind, default, " ".join(value.get("description", "").split())))
    columns = 4 if any(row[3] for row in rows) else 3
    head = ("key", "value", "default", "")[:columns]
    return "\n".join("| " + " | ".join(row[:columns]) + " |" for row in (head, ("---",) * columns, *rows))


def _default(value: Schema) -> str:
    default = value.get("default")
    if default is None or default == "":
        return ""
    return f"`{str(default).lower() if isinstance(default, bool) else default}`"


def _kind(value: Schema) -> str:
    if "const" in value:
        return f'`"{value["const"]}"`'
    if "enum" in value:
        return ", ".join(f'`"{one}"`' for one in value["enum"])
    if "anyOf" in value:
        return " or ".join(dict.fromkeys(_kind(one) for one in value["anyOf"] if one.get("type") != "null"))
    kind = str(value.get("format") or value.get("type", ""))
    if "prefixItems" in value:
        return f"{len(value['prefixItems'])} × {_kind(value['prefixItems'][0])}"
    if kind == "array":
        return f"list of {_kind(value.get('items', {}))}"
    limits = [text.format(value[name]) for name, text in LIMITS if name in value]
    return " ".join([kind, ", ".join(limits)]).strip()
