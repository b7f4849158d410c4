# SPDX-License-Identifier: MIT
"""Sphinx builds the site from the pages as they stand in the repository: './setup docs'.

The source folder is the repository's root, so that links between docs/, README.md and the model
cards are the same on the site as in the repository. HOLDFAST_BUILD names the folder where the
program and the Python module were built.
"""
import os
import re
import sys
from pathlib import Path

site = Path(__file__).resolve().parent
root = site.parents[1]
holdfast_build = (root / os.environ.get("HOLDFAST_BUILD", "build/release")).resolve()
sys.path[:0] = [str(site), str(holdfast_build / "python")]

project = "Holdfast"
author = copyright = "The Holdfast authors"
release = version = re.search(r"project\(\S+\s+VERSION\s+(\S+)", (root / "CMakeLists.txt").read_text())[1]

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "breathe",
    "sphinx_copybutton",
    "command_reference",
    "cpp_reference",
    "equations",
    "gallery",
    "python_reference",
    "links",
    "offline",
]
root_doc = "docs/index"
include_patterns = ["docs/**", "*.md", "meshes/*/README.md", "tests/fuzz/README.md"]
exclude_patterns = ["docs/README.md", "docs/site", "build*", "out", ".*", "**/node_modules"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
highlight_language = "none"
smartquotes = False

myst_heading_anchors = 4  # as GitHub makes them
myst_enable_extensions = ["dollarmath"]
myst_dmath_allow_space = myst_dmath_allow_digits = False
html_math_renderer = "mathml"

autodoc_mock_imports = ["torch"]
autodoc_member_order = "groupwise"
napoleon_google_docstring = False

breathe_default_project = "holdfast"
breathe_show_include = False

html_theme = "furo"
html_title = f"Holdfast {release}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_additional_pages = {"index": "to_docs.html"}
templates_path = ["templates"]
html_copy_source = False
html_show_sphinx = False
html_theme_options = {"top_of_page_button": None}
copybutton_prompt_text = "$ "
copybutton_only_copy_prompt_lines = True
holdfast_program = str(holdfast_build / "apps/holdfast")
