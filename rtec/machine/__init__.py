"""The parts joined: the open signal path and the closed loop."""
