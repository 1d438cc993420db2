"""X-Plane's side of the wire: sockets, subscriptions, the beacon, X-Plane Connect, and faults on request."""
