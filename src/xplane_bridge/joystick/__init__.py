"""Joysticks: reading a device with SDL, and what a file of config/joysticks makes of it."""
