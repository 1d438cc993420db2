"""Flights, controllers and recordings of them that tests use."""
