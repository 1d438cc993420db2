"""What the programs share that work with a running bridge."""
