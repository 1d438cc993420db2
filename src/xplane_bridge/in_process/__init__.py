"""One aircraft flown as the bridge flies it, in process: no UDP and no ROS."""
