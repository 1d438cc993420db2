"""The quadrotor."""
