"""camera/image_raw/compressed has one advertiser, also where an image_transport plugin offers that topic too."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Iterator

import pytest

from support.deadlines import WAIT_S
from support.nodes.late_pictures import ShownFrames, decoded, joined
from xplane_bridge.emulator.view.renderer import read_strip
from xplane_bridge.harness import ManagedProcess, wait_until
from xplane_bridge.harness.display import VirtualDisplay

PLUGIN = Path(__file__).with_name("stand_in_transport")
TOPIC = "camera/image_raw/compressed"
PICTURES = 20


@pytest.fixture
def display(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    with VirtualDisplay(tmp_path) as server:
        monkeypatch.setenv("DISPLAY", server.display)
        yield server.display


@pytest.fixture
def package(world, tmp_path: Path) -> Path:
    """The stand-in as an installed package: its manifest, its plugin list and its library in one folder."""
    folder = tmp_path / "packages" / PLUGIN.name
    shutil.copytree(PLUGIN, folder, ignore=shutil.ignore_patterns("*.cpp", "CMakeLists.txt"))
    (folder / "lib").mkdir()
    library = world.program("libstand_in_transport.so")
    (folder / "lib" / library.name).symlink_to(library)
    return folder.parent


def advertisers(topic: str) -> list[str]:
    import rosgraph

    return dict(rosgraph.Master("/tests").getSystemState()[0]).get(topic, [])


@pytest.mark.parametrize("installed", [False, True], ids=["without_plugin", "with_plugin"])
def test_compressed_has_one_advertiser(world, display, package: Path, tmp_path: Path, installed: bool) -> None:
    from sensor_msgs.msg import CompressedImage, Image

    environment = world.env
    if installed:
        environment["ROS_PACKAGE_PATH"] = os.pathsep.join([str(package), environment["ROS_PACKAGE_PATH"]])
    # A driver that goes through image_transport shows whether the plugin is there for those who look for one.
    driver = f"{world.namespace}/driver"
    publisher = [world.program("transport_publisher"), f"__ns:={driver}"]
    with ManagedProcess("transport_publisher", publisher, tmp_path, env=environment):
        plain = world.watch(f"{driver}/camera/image_raw", Image)
        plain.wait_for(what="a picture of the driver")
        assert bool(advertisers(f"{driver}/{TOPIC}")) == installed
        if installed:
            assert world.watch(f"{driver}/{TOPIC}", CompressedImage).wait_for().format == "stand-in"

    world.emulator("--window", "--fps", 20)
    world.set_param("capture_node/window", {"display": display})
    node = [world.program("capture_node"), f"__ns:={world.namespace}"]
    with ManagedProcess("capture_node", node, tmp_path, env=environment):
        jpegs = world.watch(TOPIC, CompressedImage)
        images = world.watch("camera/image_raw", Image)
        shown = ShownFrames(images.messages)  # without those of the window before its first frame

        def both() -> list:
            raw = shown.by_stamp()
            return [jpeg for jpeg in joined(jpegs, images) if jpeg.header.stamp in raw]

        wait_until(lambda: len(both()) >= PICTURES, WAIT_S, "JPEGs of the images")
        assert advertisers(f"{world.namespace}/{TOPIC}") == [f"{world.namespace}/capture_node"]
        stamps = [jpeg.header.stamp for jpeg in list(jpegs.messages)]
        assert len(set(stamps)) == len(stamps), "a picture came twice"
        for jpeg in both():
            assert jpeg.format == "bgr8; jpeg compressed bgr8"
            strip = read_strip(decoded(jpeg))
            assert strip == shown.by_stamp()[jpeg.header.stamp], "another picture than the raw image of its stamp"
