"""Analysis of recorded flights: arrays in, results with units out. No files, no plots, no ROS."""
