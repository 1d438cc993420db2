"""The emulator and other stand-ins for X-Plane in the tests' own process, and what is checked of names."""
