"""The data card: README.md of an export, for people; Hugging Face reads its head."""

from __future__ import annotations

from typing import Any, Mapping

#: Name of the card's file.
CARD = "README.md"

_Records = Mapping[str, Mapping[str, Mapping[str, Any]]]


def card(version: str, exports: _Records) -> str:
    """Write the card of a folder; the same exports give the same text.

    Args:
        version: Of this package.
        exports: Format, then flight, to its record in the manifest.
    """
    lines = [*_head(exports.get("imagefolder", {})), "# Recorded flights", ""]
    lines += [
        f"Made by `bag_export` of xplane_bridge {version} from ROS 1 bags of an X-Plane flight bridge. Names of",
        "columns end in their unit. `manifest.json` has parameters, counts and the SHA-256 of every file, with which",
        "`bag_export --verify` compares.",
    ]
    for form, flights in sorted(exports.items()):
        lines += ["", f"## {form}", "", "| flight | bags | made with | what is in it |", "|---|---|---|---|"]
        for name, record in sorted(flights.items()):
            cells = [name, ", ".join(record["bags"]), _pairs(record["parameters"]), _pairs(record["counts"])]
            lines.append("| " + " | ".join(_cell(text) for text in cells) + " |")
    lines += _topics(exports)
    lines += _quality(exports)
    return "\n".join(lines) + "\n"


def _head(flights: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Name the files of each split, so that words like "test" in a flight's name choose none."""
    splits = [split for split in ("train", "validation") if any(r["counts"][split] for r in flights.values())]
    if not splits:
        return []
    lines = ["---", "configs:", "- config_name: default", "  data_files:"]
    for split in splits:
        lines += [f"  - split: {split}", f'    path: "*/images/{split}/*"']
    return [*lines, "---", ""]


def _topics(exports: _Records) -> list[str]:
    """List the topics of the bags, with the number of messages in each flight."""
    flights: dict[str, Mapping[str, Any]] = {}
    for records in exports.values():
        flights.update({name: record["topics"] for name, record in records.items() if "topics" in record})
    names = sorted(flights)
    if not names:
        return []
    rows: dict[tuple[str, str], dict[str, int]] = {}
    for name in names:
        for topic, (msgtype, count) in flights[name].items():
            rows.setdefault((topic, msgtype), {})[name] = count
    lines = ["", "## Topics of the bags", "", "| topic | type | messages |", "|---|---|---|"]
    for (topic, msgtype), counts in sorted(rows.items()):
        lines.append(
            f"| {_cell(topic)} | {msgtype} | {sum(counts.values())} in {len(counts)} of {len(names)} flights |"
        )
    return lines


def _quality(exports: _Records) -> list[str]:
    """Count the quality bits of the frames of each flight, left out or not."""
    found = {
        name: record["quality"]
        for records in exports.values()
        for name, record in records.items()
        if record.get("quality")
    }
    if not found:
        return []
    lines = [
        "",
        "## Quality of the pictures",
        "",
        "Frames in the bags by what is said of them (a frame can have several):",
    ]
    lines += ["", "| flight | frames | perfect | said |", "|---|---|---|---|"]
    for name, quality in sorted(found.items()):
        said = ", ".join(f"{count} {word}" for word, count in sorted(quality["bits"].items()) if count)
        lines.append(f"| {_cell(name)} | {quality['frames']} | {quality['perfect']} | {said or 'nothing'} |")
    return lines


def _pairs(values: Mapping[str, Any]) -> str:
    parts = []
    for key, value in sorted(values.items()):
        if isinstance(value, Mapping):
            parts += [f"{key.replace('_', ' ')}: {_pairs(value)}"] if value else []
        elif value not in (None, []):
            text = " ".join(map(str, value)) if isinstance(value, list) else value
            parts.append(f"{key.replace('_', ' ')} {text}")
    return ", ".join(parts)


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")
