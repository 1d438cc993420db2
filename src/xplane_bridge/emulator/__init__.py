"""An X-Plane stand-in: speaks its UDP protocol and flies JSBSim aircraft of its own."""
