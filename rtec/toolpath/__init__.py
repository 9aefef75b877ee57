"""Toolpaths and the feed along them."""
