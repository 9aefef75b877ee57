"""Logs of several axes as controllers write them; each becomes the table that a CSV of ours is."""
