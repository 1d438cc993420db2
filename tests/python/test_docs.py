"""The pages' links lead somewhere, and every page is found from the index."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from xplane_bridge.surfaces import SURFACES
from xplane_bridge.topics import TOPICS

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted(
    path
    for pattern in ("*.md", "docs/**/*.md", "config/**/*.md", "src/**/*.md", "tests/*.md")
    for path in ROOT.glob(pattern)
    if ".workspace" not in path.parts and ".venv" not in path.parts
)
INDEX = ROOT / "docs/README.md"
#: Where pages are named by their path in the clone.
TEXTS = ("config", "docs", "include", "launch", "lib", "msg", "scripts", "src", "srv")
NO_TEXTS = (".png", ".jpg", ".pyc", ".gif")
ARCHITECTURE = ROOT / "docs/architecture.md"


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


def test_pages_that_texts_and_messages_name_are_there():
    dead = []
    for folder in ("README.md", "CONTRIBUTING.md", *TEXTS):
        top = ROOT / folder
        for path in [top] if top.is_file() else sorted(path for path in top.rglob("*") if path.is_file()):
            if path.suffix not in NO_TEXTS:
                text = path.read_text(encoding="utf-8", errors="replace")
                dead += [
                    (str(path), name)
                    for name in re.findall(r"\bdocs/[\w/]+\.md\b", text)
                    if not (ROOT / name).is_file()
                ]
    assert dead == []


def test_every_page_is_found_from_the_index():
    reached = {INDEX}
    waiting = [INDEX]
    while waiting:
        for target, _ in links(waiting.pop()):
            if target.suffix == ".md" and target not in reached and ROOT in target.parents:
                reached.add(target)
                waiting.append(target)
    assert {page for page in PAGES if ROOT / "docs" in page.parents} - reached == set()


# ---------------------------------------------------------------------------------------------------- what pages name


def section(page, heading):
    """The text below a heading of a page, to the next of its rank."""
    return page.read_text(encoding="utf-8").split(f"\n## {heading}\n")[1].split("\n## ")[0]


def stops():
    """The stops of the walks of architecture.md: their files, and their functions, each with the file it is in."""
    text = section(ARCHITECTURE, "Four walks")
    for stop in re.findall(r"^\d+\. (.*?)(?=\n\S|\n\n|\Z)", text, re.MULTILINE | re.DOTALL):
        files, functions = [], []
        for word in re.findall(r"`([^`]+)`", stop):
            if word.endswith("()"):
                functions.append((files[-1], word[:-2]))
            elif "/" in word and word not in TOPICS and not word.startswith("/"):
                files.append(word)
        yield pytest.param(stop, files, functions, id=f"{files[0]}-{functions[0][1] if functions else ''}")


@pytest.mark.parametrize(("stop", "files", "functions"), list(stops()))
def test_a_stop_of_a_walk_begins_with_its_file_and_all_that_it_names_is_there(stop, files, functions):
    assert stop.startswith(f"`{files[0]}`")
    assert [file for file in files if not (ROOT / file).is_file()] == []
    for file, function in functions:
        beginning = rf"\bdef {function}\(" if file.startswith(("src/", "scripts/")) else rf"(?<![.>]){function}\("
        assert re.search(beginning, (ROOT / file).read_text(encoding="utf-8")), f"{file} has no {function}()"


def test_there_are_four_walks():
    walks = section(ARCHITECTURE, "Four walks").split("\n### ")[1:]
    assert len(walks) == 4
    assert min(len(re.findall(r"^\d+\. ", walk, re.MULTILINE)) for walk in walks) >= 5


def described(text):
    """The topics between backticks; one without its folder is in that of the one before."""
    folder = ""
    for word in re.findall(r"`([^`]+)`", text):
        for topic in (word, f"{folder}/{word}"):
            if topic in TOPICS:
                folder = topic.rpartition("/")[0]
                yield topic


def test_every_topic_has_its_line():
    rows = [
        line.split("|")[1] for line in section(ROOT / "docs/nodes/topics.md", "Topics").splitlines() if line[:1] == "|"
    ]
    named = [topic for row in rows for topic in described(row)]
    assert sorted(set(TOPICS) - set(named)) == []
    assert len(named) == len(set(named)), "a topic with two lines"


#: Of the nodes, and those that a user may type.
NODES = sorted(path.stem for path in (ROOT / "src").glob("*.cpp"))
SCRIPTS = sorted(path.name for path in (ROOT / "scripts").iterdir() if path.is_file() and not path.suffix)


def test_the_index_says_where_every_node_is_described():
    index = INDEX.read_text(encoding="utf-8")
    assert [node for node in NODES if not re.search(rf"\[[^]]*\b{node}\b[^]]*\]\(", index)] == []


def test_every_program_is_named_in_a_page():
    pages = "".join(page.read_text(encoding="utf-8") for page in PAGES if ROOT / "docs" in page.parents)
    pages += (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(SCRIPTS) > 20
    assert [name for name in (*NODES, *SCRIPTS) if not re.search(rf"(?:scripts/|`|\[){name}\b", pages)] == []


def test_words_are_in_alphabetical_order():
    rows = (ROOT / "docs/glossary.md").read_text(encoding="utf-8").splitlines()
    words = [row.split("|")[1].strip().lower() for row in rows if row.startswith("| ")][1:]
    assert len(words) > 20
    assert words == sorted(words)


# ----------------------------------------------------------------------------------------------------------- the site


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


def test_the_surfaces_of_the_tools_are_those_of_their_page() -> None:
    page = (ROOT / "docs" / "control" / "surfaces.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| (`aileron1`.*?|`elevator1`.*?|`rudder1`.*?) \| (.*) \|$", page, re.MULTILINE))
    assert len(rows) == 3
    wings = [f"wing{wing}_{side}" for wing in range(1, 5) for side in ("left", "right")]
    expected = set()
    for surfaces, places in rows.items():
        named = re.findall(r"`(\w+)`", places)
        if "..." in places:
            named = [place for place in named if not place.startswith("wing")] + wings
        expected |= {f"{surface}_{place}" for surface in re.findall(r"`(\w+)`", surfaces) for place in named}
    assert set(SURFACES) == expected
