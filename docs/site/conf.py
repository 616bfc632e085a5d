"""Sphinx's settings. Nothing is loaded from the net, neither when the site is built nor when it is read."""

import os
from typing import Any

from sphinx.application import Sphinx

project = "mirrorgaze"
project_copyright = "the mirrorgaze authors"
html_title = "mirrorgaze"

extensions = ["myst_nb", "sphinx.ext.autodoc", "numpydoc", "sphinx_copybutton", "sphinx_design"]
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
autodoc_preserve_defaults = True
add_module_names = False
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 100
numpydoc_show_class_members = False
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
html_sidebars: dict[str, list[str]] = {"index": [], "changelog": [], "contributing": []}


def setup(app: Sphinx) -> None:
    """Take what stands between bars in a docstring as a magnitude, and not as a substitution."""
    app.connect("autodoc-process-docstring", _escape_bars)


def _escape_bars(*event: Any) -> None:
    lines: list[str] = event[-1]
    for number, line in enumerate(lines):
        if "``" not in line:
            lines[number] = line.replace("|", "\\|")
