"""Control surfaces by the names of tx_node (docs/control/surfaces.md)."""

from __future__ import annotations

from typing import Dict

_SIDES = ("left", "right")


def _surfaces() -> Dict[str, str]:
    names: Dict[str, str] = {}
    leaves = {"aileron": "ail", "spoiler": "spo", "flap": "fla", "speedbrake": "sbrk", "elevator": "elv"}
    on_wings = {f"{kind}{i}": f"{leaf}{i}" for kind, leaf in leaves.items() for i in (1, 2)}
    for kind, leaf in {**on_wings, "yaw_brake": "yawb"}.items():
        for wing in range(1, 5):
            names.update({f"{kind}_wing{wing}_{side}": f"wing{wing}{side[0]}_{leaf}" for side in _SIDES})
    for i in (1, 2):
        names.update({f"elevator{i}_{side}": f"hstab{half}_elv{i}" for half, side in enumerate(_SIDES, 1)})
        names.update({f"rudder{i}_fin{fin}": f"vstab{fin}_rud{i}" for fin in (1, 2)})
    return names


#: What X-Plane's datarefs call each (`aileron1_wing2_left` is `wing2l_ail1`), and the flight models, too.
SURFACES = _surfaces()
