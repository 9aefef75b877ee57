"""The process that owns the terminal while box or PC run: it draws what it is told, and takes what is typed.

It is a process of its own so that drawing never keeps the loop from its readings, and so that the terminal is put in
order again however the other process ends, killed or not.
"""

from __future__ import annotations

import json
import os
import select
import signal
import sys
from typing import Any

READ_BYTES = 1 << 16
BACKSPACE = ("\x7f", "\b")
ERASE_LINE = "\x15"
FIRST_PRINTABLE = " "


class TypedText:
    r"""A line while it is typed.

    Examples
    --------
    >>> typed = TypedText()
    >>> typed.take("hone\x7f\x7fme\nst"), typed.text
    (['home'], 'st')
    """

    def __init__(self) -> None:
        self.text = ""

    def take(self, keys: str) -> list[str]:
        """Take keys; return the lines that are complete."""
        lines = []
        for key in keys:
            if key in "\r\n":
                lines.append(self.text)
                self.text = ""
            elif key in BACKSPACE:
                self.text = self.text[:-1]
            elif key == ERASE_LINE:
                self.text = ""
            elif key >= FIRST_PRINTABLE:
                self.text += key
        return lines


def last_document(data: bytes) -> tuple[dict[str, Any] | None, bytes]:
    r"""Return the last whole document of what has come, and the rest.

    Examples
    --------
    >>> last_document(b'{"a": 1}\n{"a": 2}\n{"a"')
    ({'a': 2}, b'{"a"')
    """
    *whole, rest = data.split(b"\n")
    return (json.loads(whole[-1]) if whole else None), rest


def run(keys_from: int, lines_to: int) -> None:
    """Draw the documents that come on standard input until it ends.

    Parameters
    ----------
    keys_from
        File descriptor of the terminal's keyboard; -1: nothing is typed.
    lines_to
        File descriptor to which typed lines are written.
    """
    from rich.console import Console  # noqa: PLC0415 - after the signals are taken care of
    from rich.live import Live  # noqa: PLC0415 - only where a screen is drawn

    from rtec.live.picture import picture  # noqa: PLC0415 - as above

    console = Console(highlight=False)
    typed, document, rest = TypedText(), None, b""
    open_to = [0] + ([keys_from] if keys_from >= 0 else [])
    with Live(console=console, auto_refresh=False, redirect_stdout=False, redirect_stderr=False) as live:
        while True:
            ready, _, _ = select.select(open_to, [], [])
            if keys_from in ready:
                keys = os.read(keys_from, READ_BYTES)
                if not keys:
                    open_to.remove(keys_from)
                for line in typed.take(keys.decode(errors="replace")):
                    os.write(lines_to, f"{line}\n".encode())
            if 0 in ready:
                data = os.read(0, READ_BYTES)
                if not data:
                    return
                newest, rest = last_document(rest + data)
                document = newest if newest is not None else document
            if document is not None:
                live.update(picture(document, typed=typed.text, width=console.width), refresh=True)


def main(keys_from: int, lines_to: int) -> None:
    """Take the terminal over, draw, and give it back as it was."""
    import termios  # noqa: PLC0415 - not on Windows
    import tty  # noqa: PLC0415 - Windows has none

    # Ctrl-C is for the other process; when that ends, so does the pipe
    # and where that is killed, this one is in the background and has the terminal to put in order still
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGTTOU):
        signal.signal(number, signal.SIG_IGN)
    before = termios.tcgetattr(keys_from) if keys_from >= 0 else None
    try:
        if keys_from >= 0:
            tty.setcbreak(keys_from)
        run(keys_from, lines_to)
    except OSError:
        pass  # the terminal or the other process has gone
    finally:
        if before is not None:
            termios.tcsetattr(keys_from, termios.TCSADRAIN, before)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
