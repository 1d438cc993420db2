"""How long tests wait for what should come at once."""

#: A machine busy with other work is slow; what hangs is silent for ever. Nothing is judged by how soon it comes [s].
WAIT_S = 60.0
#: How long a program may take that starts, does a little and ends [s].
PROGRAM_S = 300.0
