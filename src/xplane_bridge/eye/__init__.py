"""Pictures of X-Plane's window, sent from X-Plane's own computer to `capture_node`: what `xplane_eye` does.

`grab_linux`, `grab_windows` and `grab_macos` notice a new picture and read it, each on its system; `rref` hears each of
X-Plane's frames; `pairing` decides which frame a picture shows, by a delay that `calibrate` has measured; `sender`
takes picture and frame to ROS in the bytes of `wire`; `program` puts these together.

Standard library, numpy and OpenCV (or simplejpeg) only: no ROS, no emulator, and nothing that only Linux has.
"""
