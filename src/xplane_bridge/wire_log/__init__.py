"""Recordings of the wire: the bridge's own wire logs, and captures of tcpdump and Wireshark; standard library only.

`capture` reads the files, `datagrams` finds UDP in what they hold, `fragments` puts datagrams together that came in
several packets, `own_log` reads what the bridge wrote, `records` are what a node plays, `strangers` makes that of
another program's capture, `anonymous` takes addresses and names out.
"""
