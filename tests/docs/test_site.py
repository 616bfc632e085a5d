"""What the site is made from: staged pages, the help of commands, the rig file's schema. Sphinx is not run here."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest
from typer.main import get_command

from mirrorgaze.cli import app
from rigs import Rig

ROOT = Path(__file__).parents[2]
staging, commands, rig_file, python, gallery = (
    importlib.import_module(f"docs.site.{name}")
    for name in ("staging", "command_pages", "rig_file_page", "python_pages", "gallery")
)


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """The site's source folder, without the Python pages."""
    folder = tmp_path_factory.mktemp("source")
    staging.stage(ROOT, folder)
    commands.write_command_pages(folder / "reference" / "command_line")
    rig_file.write_rig_file_page(
        Rig.model_json_schema(), ROOT / "rigs/presets/aqua2.toml", folder / "reference" / "rig_file.md"
    )
    gallery.stand_ins(folder / "gallery.md")
    (folder / "reference" / "python").mkdir()
    (folder / "reference" / "python" / "index.md").touch()
    return folder


def test_links_lead_somewhere_on_the_site(source):
    """Also those that are turned from the repository's places to the site's, and those of the tables of contents."""
    links = re.compile(r"\]\((?!https?:)([^)#\s]+)")
    code = re.compile(r"```(?!{toctree}).*?```|`[^`]*`", flags=re.DOTALL)
    broken = [
        f"{page.relative_to(source)}: {target}"
        for page in source.rglob("*.md")
        for target in links.findall(code.sub("", page.read_text(encoding="utf-8")))
        if not (page.parent / target).exists()
    ]
    assert broken == []


def test_generated_pages_are_generated(source):
    assert [page for page in staging.GENERATED if not (source / page).exists()] == []


def test_every_door_has_its_contents(source):
    for door in staging.DOORS:
        assert "```{toctree}" in (source / door / "index.md").read_text(encoding="utf-8")


def test_every_command_and_option_has_its_place(source):
    for name, command in get_command(app).commands.items():
        page = (source / "reference" / "command_line" / f"{name}.md").read_text(encoding="utf-8")
        options = [o for p in command.params if not getattr(p, "hidden", False) for o in p.opts if o.startswith("--")]
        assert [option for option in options if option not in page and option != "--help"] == []
        assert f"[{name}]({name}.md)" in (source / "reference/command_line/index.md").read_text(encoding="utf-8")


def test_every_key_of_the_rig_file_has_its_place(source):
    page = (source / "reference" / "rig_file.md").read_text(encoding="utf-8")
    schema = Rig.model_json_schema()
    keys = [key for section in (schema, *schema["$defs"].values()) for key in section.get("properties", ())]
    assert [key for key in keys if f"| `{key}` |" not in page] == []


def test_every_picture_of_the_gallery_is_made_by_a_line_above_it():
    page = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    for picture in gallery.images(page):
        above = gallery.command_lines(page.partition(f"]({picture})")[0])
        made = Path(above[-1][above[-1].index("-o") + 1])
        assert made in {Path(picture), *Path(picture).parents}


def test_kinds_limits_and_defaults_of_a_section():
    schema = {
        "properties": {"size": {"$ref": "#/$defs/Size"}},
        "$defs": {
            "Size": {
                "description": "How large.",
                "required": ["width_mm"],
                "properties": {
                    "width_mm": {"type": "number", "exclusiveMinimum": 0},
                    "shape": {"enum": ["round", "square"], "default": "round"},
                    "at_mm": {"type": "array", "prefixItems": [{"type": "number"}] * 3, "default": [0.0, 0.0, 0.0]},
                },
            }
        },
    }
    page = rig_file.rig_file_page(schema)
    assert "## `[size]`\n\nHow large." in page
    assert "| `width_mm` | number > 0 | required |" in page
    assert '| `shape` | `"round"`, `"square"` | `round` |' in page
    assert "| `at_mm` | 3 × number | `[0.0, 0.0, 0.0]` |" in page


def test_every_package_has_its_python_pages():
    assert python.packages(ROOT) == ["rigs", "optics", "cad", "scenes", "tracking", "dives", "reports", "studio"]
    assert "OpticalTrain" in python.public_names("optics")
