"""How fast the encoder may go, for each design on each processor, found on the running firmware."""
