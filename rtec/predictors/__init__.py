"""Error models that tell the PC what to correct."""
