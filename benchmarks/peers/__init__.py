"""Other programs that do a part of rtec's work, built and timed on the same job.

Each peer is a function that returns its figures as a dictionary and raises `PeerAbsent` where the program it needs is
not installed, so that a comparison is skipped with that message.
"""

from __future__ import annotations

import shutil


class PeerAbsent(Exception):  # noqa: N818 - a reason to skip, not a failure
    """A program that the peer needs is not on PATH; the message names it and the package that holds it."""


class PeerFailedError(Exception):
    """The peer was found but did not do its job; the message holds the end of what it printed."""


def program(name: str, package: str) -> str:
    """Return the path of a program, or raise `PeerAbsent` naming the package that brings it."""
    found = shutil.which(name)
    if found is None:
        raise PeerAbsent(f"{name} is not on PATH; install it from the system's package '{package}' to compare")
    return found
