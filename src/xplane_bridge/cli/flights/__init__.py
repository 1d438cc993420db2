"""Programs for recorded flights, several or once more."""
