"""The data card: README.md of an export, for people; Hugging Face reads its head."""

from __future__ import annotations

import json
from typing import Any, Mapping, Optional, Sequence

#: Name of the card's file.
CARD = "README.md"

_Records = Mapping[str, Mapping[str, Mapping[str, Any]]]


def card(version: str, exports: _Records) -> str:
    """Write the card of a folder; the same exports give the same text.

    Args:
        version: Of this package.
        exports: Format, then flight, to its record in the manifest.
    """
    others = any(form in exports for form in ("coco", "yolo", "lard"))
    lines = [*_head(exports.get("imagefolder", {}), others), "# Recorded flights", ""]
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
    lines += _cameras(exports)
    lines += _quality(exports)
    lines += _labels(exports)
    return "\n".join(lines) + "\n"


def _head(flights: Mapping[str, Mapping[str, Any]], others: bool) -> list[str]:
    """Name the files of each split, so that words like "test" in a flight's name choose none."""
    splits = [split for split in ("train", "validation") if any(r["counts"][split] for r in flights.values())]
    if not splits:
        return []
    lines = ["---", "configs:", "- config_name: default", "  data_files:"]
    for split in splits:
        # By name where other formats have pictures, too.
        names = sorted(name for name, record in flights.items() if record["counts"][split]) if others else ["*"]
        paths = [json.dumps(f"{name}/images/{split}/*") for name in names]
        lines += [f"  - split: {split}", f"    path: {paths[0] if len(paths) == 1 else '[' + ', '.join(paths) + ']'}"]
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


def _cameras(exports: _Records) -> list[str]:
    """Say what each camera was: size, K, where it is in the aircraft, and the delay of its display."""
    found = {
        (name, row["name"]): row
        for records in exports.values()
        for name, record in records.items()
        for row in record.get("cameras", [])
    }
    if not found:
        return []
    lines = [
        *("", "## Cameras", ""),
        "K and place of the picture nearest to the median; place and quaternion x, y, z, w as in `body_to_camera` (in",
        "base_link: forward, left, up), with the farthest of the flight's pictures from it.",
        "",
        "| flight | camera | size | fx, fy, cx, cy [px] | place [m] | quaternion | farthest | display delay |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for (name, camera), row in sorted(found.items()):
        (fx, _, cx), (_, fy, cy) = row["camera_matrix"][:2]
        delay = row["display_delay_s"]
        cells = [
            *(name, camera, f"{row['width_px']}x{row['height_px']}" if row["width_px"] else "not recorded"),
            _numbers((fx, fy, cx, cy), ".2f"),
            _numbers(row["body_to_camera_translation_m"], ".3f"),
            _numbers(row["body_to_camera_rotation_xyzw"], ".5f"),
            f"{_numbers([row['body_to_camera_spread_m']], '.3f')} m, "
            f"{_numbers([row['body_to_camera_spread_deg']], '.2f')} deg",
            f"{_numbers([None if delay is None else 1e3 * delay], '.1f')} ms, {row['display_delay_source']}",
        ]
        lines.append("| " + " | ".join(map(_cell, cells)) + " |")
    return lines


def _numbers(values: Sequence[Optional[float]], form: str) -> str:
    return ", ".join("-" if value is None else format(value, form) for value in values)


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
        for camera, part in quality.get("cameras", {"": quality}).items():
            said = ", ".join(f"{count} {word}" for word, count in sorted(part["bits"].items()) if count)
            whose = f"{name}, camera {camera}" if camera else name
            lines.append(f"| {_cell(whose)} | {part['frames']} | {part['perfect']} | {said or 'nothing'} |")
    return lines


def _labels(exports: _Records) -> list[str]:
    """Say what is labelled in the pictures, where a format has labels."""
    found = {
        name: record["counts"]
        for records in exports.values()
        for name, record in sorted(records.items())
        if "labelled" in record["counts"]
    }
    if not found:
        return []
    lines = ["", "## Labels of the pictures", ""]
    if not any(counts["labelled"] for counts in found.values()):
        return [*lines, "There are none: no pictures are labelled (`label_images`, then `bag_export --labels`)."]
    lines += [
        "Projected by `label_images` from the camera's measured pose, not seen in the pixels: what terrain, haze or",
        "the cockpit hide is labelled too. Each object has its sigma in pixels; `coarse` ones are above 3.",
        *("", "| flight | pictures labelled | objects |", "|---|---|---|"),
    ]
    for name, counts in sorted(found.items()):
        objects = _pairs(counts.get("objects", {})) or "none"
        lines.append(f"| {_cell(name)} | {counts['labelled']} of {counts['exported']} | {objects} |")
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
