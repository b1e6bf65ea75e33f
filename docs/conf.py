"""How Sphinx builds the site: `make docs`."""

from __future__ import annotations

from importlib.metadata import version as version_of
from pathlib import Path

from sphinx.application import Sphinx

project = "cps_envs"
author = "the cps_envs contributors"
copyright = f"2026, {author}"
release = version_of("cps-envs")

extensions = ["myst_nb", "sphinx_copybutton", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
default_role = "code"  # docstrings are written in Markdown, as the pages are
autodoc_typehints = "description"
autodoc_class_signature = "separated"
nb_execution_mode = "cache"  # notebooks are run when they have changed
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_execution_cache_path = "../build/notebooks"
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 4
source_suffix = {".md": "myst-nb", ".ipynb": "myst-nb"}
exclude_patterns = ["_build"]

html_theme = "furo"
html_title = "cps_envs"
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#0f766e", "color-brand-content": "#0f766e"},
    "dark_css_variables": {"color-brand-primary": "#5eead4", "color-brand-content": "#5eead4"},
}
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = ["sort.js"]  # of the boards
html_copy_source = False
DEMO = Path(__file__).parents[1] / "build" / "extra"  # a report, by `make demo`
html_extra_path = [str(DEMO)] if DEMO.is_dir() else []
copybutton_prompt_text = r">>> |\$ "
copybutton_prompt_is_regexp = True

PLACES = {"](SECURITY.md": "](security.md", "](CONTRIBUTING.md": "](contributing.md", "](examples/": "](../examples/"}


def setup(app: Sphinx) -> None:
    """Let links of the files beside docs/, which pages include, lead to the pages."""
    app.connect("include-read", _mend)


def _mend(_app: Sphinx, _path: Path, _document: str, content: list[str]) -> None:
    for link, page in PLACES.items():
        content[0] = content[0].replace(link, page)
