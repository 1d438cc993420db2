"""Linear models of an aircraft: estimated from recorded manoeuvres, or worked out from the emulator's aircraft."""
