"""The pages' links lead somewhere, and every page is found from the index."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted(
    path
    for pattern in ("*.md", "docs/**/*.md", "config/**/*.md", "src/**/*.md", "tests/*.md")
    for path in ROOT.glob(pattern)
    if ".workspace" not in path.parts and ".venv" not in path.parts
)
INDEX = ROOT / "docs/README.md"


def links(page):
    """Targets of a page's links and pictures that are files here: (target, anchor)."""
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if "://" not in target and not target.startswith("mailto:"):
            path, _, anchor = target.partition("#")
            yield (page.parent / path).resolve() if path else page, anchor


def anchors(page):
    """The anchors of a page's headings, as the hosts of repositories make them."""
    titles = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.strip().lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_no_link_is_dead(page):
    for target, anchor in links(page):
        assert target.exists(), f"{page.name} points to {target}"
        if anchor:
            assert anchor in anchors(target), f"{page.name} points to #{anchor} of {target.name}"


def test_every_page_is_found_from_the_index():
    reached = {INDEX}
    waiting = [INDEX]
    while waiting:
        for target, _ in links(waiting.pop()):
            if target.suffix == ".md" and target not in reached and ROOT in target.parents:
                reached.add(target)
                waiting.append(target)
    assert {page for page in PAGES if page.parent == ROOT / "docs"} - reached == set()


def site(source, output):
    """What Sphinx says of a site, a warning being an error, and how it ends."""
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-c", str(source / "docs")]
    return subprocess.run([*command, str(source), str(output)], capture_output=True, text=True)


def test_the_site_is_built_without_a_warning_and_lists_every_page_of_the_index(tmp_path):
    built = site(ROOT, tmp_path)
    assert built.returncode == 0, built.stderr
    side_bar = (tmp_path / "README.html").read_text(encoding="utf-8").split('class="sidebar-tree"')[1]
    for target, _ in links(INDEX):
        if target.suffix == ".md" and target != ROOT / "README.md":
            page = target.relative_to(ROOT).with_suffix(".html")
            assert f'href="{page}"' in side_bar, page


def test_the_site_is_not_built_with_a_dead_link(tmp_path):
    source = tmp_path / "source"
    shutil.copytree(ROOT / "docs", source / "docs")
    (source / "README.md").write_text("# Title\n\n[a](docs/none.md)\n", encoding="utf-8")
    built = site(source, tmp_path / "site")
    assert built.returncode != 0
    assert "docs/none" in built.stderr
