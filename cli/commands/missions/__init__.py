"""Commands for missions: import, simulation, replay, planning and validation."""
