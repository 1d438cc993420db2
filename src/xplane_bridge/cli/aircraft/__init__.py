"""Programs about one kind of aircraft: its file, and controllers that fly it."""
