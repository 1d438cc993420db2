"""What tests of nodes start, publish and hear."""
