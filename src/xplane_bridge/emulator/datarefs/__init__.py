"""What datarefs, DATA rows and commands mean: each is read from the flight or moves something in it."""
