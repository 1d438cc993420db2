"""Looks at one thing each and returns what is there, without judging it; nothing here raises for what it finds."""
