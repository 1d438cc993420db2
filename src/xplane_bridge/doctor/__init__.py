"""Why nothing arrives from X-Plane, or that all is well: what `scripts/xplane_doctor` finds out.

Three steps, each in its own place: `observe` looks at network, X-Plane, files and devices and returns facts without
judging them; `checks` turns facts into findings without touching anything; `report` words the findings. `examination`
runs them in this order, within 15 s.

Uses Python's standard library and `xplane_bridge.protocol` only: no ROS, no package from PyPI, so that it runs on a
computer where the installation of those is what went wrong.
"""
