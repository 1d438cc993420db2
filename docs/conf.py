"""The pages of this repository as a site: `pip install .[docs]`, then `sphinx-build -W -c docs . build/site`."""

import re
from pathlib import Path

project = "xplane_bridge"
copyright = "the authors of xplane_bridge"  # noqa: A001 (Sphinx's own name)
extensions = ["myst_parser"]
# The source is the repository: its pages link each other as they lie in a clone, and here those links work as well.
root_doc = "README"
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
include_patterns = ["*.md", "CHANGELOG.rst", "config/*/*.md", "docs/*.md", "docs/*/*.md"]
exclude_patterns = [".*", "build"]
suppress_warnings = ["toc.not_included"]  # pages that only another page leads to
myst_heading_anchors = 4
html_theme = "furo"
html_title = "xplane_bridge"

INDEX = Path(__file__).with_name("README.md")


def contents():
    """The lists of the side bar, in MyST: a list for each row of the index, titled by what its reader wants."""
    for wish, links in re.findall(r"^\| ([^|]+) \| (.*) \|$", INDEX.read_text(encoding="utf-8"), re.MULTILINE):
        pages = [
            f"{title} <{(INDEX.parent / path).resolve().relative_to(INDEX.parents[1]).with_suffix('')}>"
            for title, path in re.findall(r"\[([^]]+)\]\(([^)#]+\.md)\)", links)
            if path != "../README.md"
        ]
        if pages:
            yield "\n".join(["```{toctree}", ":hidden:", f":caption: To {wish.strip()}", "", *pages, "```"])


def with_contents(_app, document, source):
    """Gives the first page the side bar's lists, which a reader of the repository does not need."""
    if document == root_doc:
        source[0] += "\n\n" + "\n\n".join(contents()) + "\n"


def setup(app):
    """Called by Sphinx."""
    app.connect("source-read", with_contents)
