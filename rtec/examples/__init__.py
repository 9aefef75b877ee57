"""Insertion algorithms to begin with: files for `rtec check`, right ones and ones with a planted bug."""
