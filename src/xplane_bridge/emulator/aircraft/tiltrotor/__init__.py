"""The tiltrotor."""
