"""The test card: a flight of two minutes that settles what only a live X-Plane can show.

`questions` has the card, a function a question; `flight` and `pilot` place the aircraft and keep it level and high;
`link` reads and writes; `journal` notes what is to be undone before it is changed; `card` runs the questions and puts
everything back; `results` writes the file that the nodes read at start, and the report.

Python's standard library and `xplane_bridge.protocol` only, as the whole doctor.
"""
