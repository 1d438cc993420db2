"""What a service does with a request in which nothing is given, e.g. `rosservice call ... "{}"`."""

from __future__ import annotations

import contextlib
import re
from pathlib import Path
from typing import Any

import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import call_linked, tx_params
from xplane_bridge.constants import ResultCode
from xplane_bridge.harness.processes import wait_until

ROOT = Path(__file__).resolve().parents[3]
#: A refusal says what is missing.
WORDS = re.compile(r"expected|give a place")

#: Services that an empty request asks for something, in the words of docs/nodes/services.md.
MEANT = {
    "lockstep/step": "holds or pauses",
    "tx_node/clear_failures": "repairs all",
    "tx_node/identify_surfaces": "identifies",
    "tx_node/pause": "resumes",
}


@pytest.fixture
def bridge(world: Any) -> Any:
    world.xplane = world.emulator("--start", "air")
    world.set_param("stale_after", 5.0)  # late frames are no lost link
    world.set_param("aircraft", "fixed_wing")
    world.start("rx_node")
    world.start("tx_node", tx_params())
    return world


def own_services(world: Any) -> dict[str, Any]:
    """The services of this namespace whose request has fields, by their names below it; logging is ROS's own."""
    import rosservice

    found = {}

    def class_of(name: str) -> Any:
        def said() -> Any:  # again where a busy node has not said it in rosservice's five seconds
            with contextlib.suppress(rosservice.ROSServiceIOException):
                return rosservice.get_service_class_by_name(name)

        return wait_until(said, WAIT_S, f"the type of {name}")

    for name in rosservice.get_service_list(namespace=world.namespace):
        kind = class_of(name)
        if kind._request_class.__slots__ and not kind._type.startswith("roscpp/"):
            found[name[len(world.namespace) + 1 :]] = kind
    return found


def test_nothing_given_is_refused_by_every_service_that_does_not_mean_it(bridge: Any) -> None:
    bridge.wait_for_diagnostics("control")
    bridge.wait_for_diagnostics("flight state")  # both nodes have started
    services = own_services(bridge)
    assert set(MEANT) < set(services)
    page = (ROOT / "docs/nodes/services.md").read_text(encoding="utf-8")
    for name, kind in sorted(services.items()):
        if name in MEANT:
            leaf = name.rsplit("/", 1)[-1]
            assert f'`{leaf} "{{}}"` {MEANT[name]}' in page, "docs/nodes/services.md says what which means"
            continue
        answer = call_linked(bridge, name, kind)
        assert (answer.success, answer.result.code) == (False, ResultCode.REFUSED), f"{name}: {answer}"
        assert WORDS.search(answer.result.message), f"{name}: {answer.result.message}"
