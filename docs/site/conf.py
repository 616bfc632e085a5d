"""Sphinx's settings. Nothing is loaded from the net, neither when the site is built nor when it is read."""

import os
import re
from typing import Any

from sphinx.application import Sphinx
from sphinx.ext.napoleon.docstring import GoogleDocstring

project = "mirrorgaze"
project_copyright = "the mirrorgaze authors"
html_title = "mirrorgaze"

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton", "sphinx_design"]
root_doc = "index"
highlight_language = "text"  # of blocks that name none

myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence", "deflist"]

nb_execution_mode = os.environ.get("MIRRORGAZE_DOCS_NOTEBOOKS", "force")
nb_execution_timeout = 1200
nb_execution_raise_on_error = True
nb_execution_in_temp = True
nb_merge_streams = True

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
add_module_names = False
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 100
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True  # attributes in a list, described once
suppress_warnings = ["ref.python"]  # a type's short name may be that of several classes
default_role = "py:obj"

html_theme = "pydata_sphinx_theme"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "show_prev_next": False,
    "navigation_with_keys": False,
    "show_nav_level": 1,
    "navigation_depth": 2,
    "collapse_navigation": True,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "header_links_before_dropdown": 6,
}
html_sidebars: dict[str, list[str]] = {"index": [], "gallery": [], "changelog": [], "contributing": []}


PACKAGES = ("rigs", "optics", "cad", "scenes", "tracking", "dives", "reports", "studio")


def setup(app: Sphinx) -> None:
    """Read docstrings as they are written here."""
    # What stands under a constant is a sentence: napoleon would take what comes before a colon for its type.
    GoogleDocstring._parse_attribute_docstring = GoogleDocstring._consume_to_end
    app.connect("autodoc-process-docstring", _escape_bars, priority=400)  # before napoleon
    app.connect("autodoc-skip-member", _skip_foreign)


def _escape_bars(*event: Any) -> None:
    """Take what stands between bars as a magnitude, and not as a substitution."""
    lines: list[str] = event[-1]
    for number, line in enumerate(lines):
        pieces = re.split(r"(``[^`]*``)", line)
        lines[number] = "".join(p if p.startswith("``") else p.replace("|", "\\|") for p in pieces)


def _skip_foreign(*event: Any) -> bool | None:
    """Leave out classes that a module has imported from elsewhere."""
    member = event[3]
    foreign = isinstance(member, type) and member.__module__.partition(".")[0] not in PACKAGES
    return True if foreign else None
