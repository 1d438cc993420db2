"""The physics that the aircraft share: the interface of a flight model, the planet, JSBSim, rotors, trim."""
