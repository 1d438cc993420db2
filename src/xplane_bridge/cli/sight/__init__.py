"""Programs about what X-Plane shows."""
