"""From a file to what can be explained: rows, the conditions at each of them, and which of them repeat each other."""
