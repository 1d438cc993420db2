"""Flights as files for other programs: tables, arrays, trajectories, image data sets, recordings in other formats."""
