"""Flights as files for other programs: tables, trajectories, and data sets of images with their labels."""
