"""What a launch file comes to, without starting anything."""

from __future__ import annotations

from typing import Any

from xplane_bridge.resources import config_file


def load(master: Any, file: str, *arguments: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """The nodes that a launch file starts, and the parameters that it sets, by their names.

    Args:
        master: of the test; there has to be one.
        file: its name.
        *arguments: as roslaunch takes them, e.g. "ns:=lab".
    """
    assert master.uri
    import roslaunch

    roslaunch.substitution_args._rospack = None  # it remembers which packages there were
    config = roslaunch.config.ROSLaunchConfig()
    path = str(config_file("common.yaml").parents[1] / "launch" / file)
    roslaunch.xmlloader.XmlLoader().load(path, config, argv=list(arguments), verbose=False)
    return {node.name: node for node in config.nodes}, {key: param.value for key, param in config.params.items()}
