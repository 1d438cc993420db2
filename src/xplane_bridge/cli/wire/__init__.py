"""Programs about the wire log."""
