"""The error that a user of the firmware model can meet.

What a simulated processor does wrong (a reserved opcode, a stack overflow) is a result, `Fault`, never an exception.
"""

from __future__ import annotations

import re

_IN_WORDS = re.compile(r"[A-Za-z]+ \w|\d+ [a-z]{2,}s\b")
"""A value that is told in words, "no record" or "9 digits", and not quoted."""


class FirmwareError(ValueError):
    """A value or a file given by the caller is outside what is allowed.

    Parameters
    ----------
    what
        Name of the argument, or the file with its line.
    value
        The value found.
    allowed
        What would have been accepted: it completes a sentence that begins with "use".
    hint
        What to do about it (optional).

    Examples
    --------
    >>> str(FirmwareError("part", "'8048'", "8051 or 8052"))
    "part: '8048' is not valid; use 8051 or 8052"
    """

    def __init__(self, what: str, value: object, allowed: str, hint: str = "") -> None:
        self.what, self.value, self.allowed, self.hint = what, value, allowed, hint
        verb = "" if isinstance(value, str) and _IN_WORDS.match(value) else " is not valid"
        super().__init__(f"{what}: {value}{verb}; use {allowed}{'; ' + hint if hint else ''}")
