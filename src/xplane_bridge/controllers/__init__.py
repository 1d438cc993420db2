"""Controllers to copy: attitude, velocity and position loops of three aircraft, and flights made of them.

A controller is a class whose `fly` answers a FlightState (units and names of FlightState.msg) with fields of
ControlCommand, and whose `restart` is called while another source flies. It knows nothing of ROS and looks at no clock.
"""
