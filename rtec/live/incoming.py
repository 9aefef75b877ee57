"""What the process of box or PC sends to the one that owns the terminal: lines to tell, and documents to draw."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from rtec.io import json_text, parse_json

READ_BYTES = 1 << 16
SAY = "say"


def say_line(text: str) -> bytes:
    """Return what asks for a line of text to be told."""
    return json_text({SAY: text}).encode() + b"\n"


def document_line(document: Mapping[str, Any]) -> bytes:
    """Return what asks for a document to be drawn."""
    return json_text(document).encode() + b"\n"


class Incoming:
    r"""The receiving end.

    Parameters
    ----------
    descriptor
        File descriptor to read from.

    Examples
    --------
    Every line counts, of the documents the last one; at the end there is nothing to come:

    >>> read, write = os.pipe()
    >>> sent = say_line("home") + document_line({"a": 1}) + say_line("go") + document_line({"a": 2})
    >>> _ = os.write(write, sent + b'{"a"'), os.close(write)
    >>> incoming = Incoming(read)
    >>> incoming.take()
    (['home', 'go'], {'a': 2}, False)
    >>> incoming.take()
    ([], None, True)
    """

    def __init__(self, descriptor: int) -> None:
        self.descriptor = descriptor
        self._rest = b""

    def take(self) -> tuple[list[str], dict[str, Any] | None, bool]:
        """Return the lines that have come, the last document, and whether nothing more can come; waits for a byte."""
        data = os.read(self.descriptor, READ_BYTES)
        *whole, self._rest = (self._rest + data).split(b"\n")
        said, document = [], None
        for line in whole:
            item = parse_json(line)
            if SAY in item:
                said.append(item[SAY])
            else:
                document = item
        return said, document, not data
