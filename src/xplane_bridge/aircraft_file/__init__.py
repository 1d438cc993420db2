"""What X-Plane shows of the aircraft that is loaded, and the file by which tx_node flies it."""
