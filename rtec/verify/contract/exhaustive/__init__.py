"""All reachable states of encoder, box and decoder on a grid of time (docs/exhaustive.md)."""
