"""The site: `.ci/docs` builds it in a fresh environment, `sphinx-build -W docs FOLDER` in the present one."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

import fembeam

project, author = "fembeam", "the fembeam authors"
version = release = fembeam.__version__
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
    "docstrings",
    "course",
    "mathml",
    "formulas",
]
exclude_patterns = [
    "_build",
    "_templates",
    "gallery/*.md5",
    "gallery/*.ipynb",
    "gallery/*.py",
    "**sg_execution_times.rst",
]
templates_path = ["_templates"]
default_role = "py:obj"
highlight_language = "none"  # indented blocks are formulas; code says its language
suppress_warnings = ["config.cache"]  # the order of examples is a class of ours
myst_heading_anchors = 3

html_math_renderer = "mathml"
myst_enable_extensions = ["dollarmath"]

html_theme = "pydata_sphinx_theme"
html_title = f"fembeam {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
# no pages stand below these
html_sidebars = {page: [] for page in ("tutorial/first_hour", "evidence", "architecture", "changelog")}
html_theme_options = {
    "show_prev_next": True,
    "navigation_with_keys": False,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}
copyright = "2026, the fembeam authors; MIT licence"

autosummary_generate = True
autosummary_ignore_module_all = False
autosummary_imported_members = True
autodoc_typehints = "none"  # the docstrings say shape and unit
autodoc_preserve_defaults = True
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

sphinx_gallery_conf = {
    "examples_dirs": "_build/examples",
    "gallery_dirs": "gallery",
    "within_subsection_order": "course.Lesson",
    "image_scrapers": ("course.written_figures",),
    "reset_argv": "course.arguments",
    "reset_modules": (),
    "filename_pattern": ".",
    "abort_on_example_error": True,
    "download_all_examples": True,
    "remove_config_comments": True,
    "show_memory": False,
    "show_signature": False,
    "min_reported_time": 1,
    "write_computation_times": False,  # their table loads scripts from elsewhere
    "log_level": {"backreference_missing": "debug"},
}
