"""A flight model without dynamics, for tests and for machines without JSBSim."""
