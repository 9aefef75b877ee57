"""Two-level signals in time: the Gray code, edge streams, merging, waveform files."""
