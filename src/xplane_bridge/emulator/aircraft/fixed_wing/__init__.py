"""The light twin."""
