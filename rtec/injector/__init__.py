"""The box between encoder and controller: the four insertion designs, their timing, and what the gates do."""
