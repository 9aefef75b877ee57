"""The process that owns the terminal while box or PC run: it draws what it is told, and takes what is typed.

It is a process of its own so that drawing never keeps the loop from its readings, and so that the terminal is put in
order again however the other process ends, killed or not.
"""

from __future__ import annotations

import signal
import sys

from rtec.live.incoming import Incoming


def draw() -> None:
    """Draw the documents that come on standard input until it ends."""
    from rich.console import Console  # noqa: PLC0415 - after the signals are taken care of
    from rich.live import Live  # noqa: PLC0415 - only where a screen is drawn

    from rtec.live.picture import picture  # noqa: PLC0415 - as above

    console = Console(highlight=False)
    incoming = Incoming(0)
    with Live(console=console, auto_refresh=False, redirect_stdout=False, redirect_stderr=False) as live:
        while True:
            said, document, ended = incoming.take()
            for line in said:
                live.console.print(line, markup=False)
            if document is not None:
                live.update(picture(document, width=console.width), refresh=True)
            if ended:
                return


def main(keys_from: int, lines_to: int, owner: int) -> None:
    """Take the terminal over, draw, and give it back as it was.

    Parameters
    ----------
    keys_from
        File descriptor of the terminal's keyboard; -1: nothing is typed.
    lines_to
        File descriptor to which typed lines are written.
    owner
        Number of the process that started this one.
    """
    import termios  # noqa: PLC0415 - not on Windows

    # Ctrl-C is for the other process; when that ends, so does the pipe
    # and where that is killed, this one is in the background and has the terminal to put in order still
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGTTOU):
        signal.signal(number, signal.SIG_IGN)
    before = termios.tcgetattr(keys_from) if keys_from >= 0 else None
    try:
        if keys_from >= 0:
            from rtec.live.prompt import run  # noqa: PLC0415 - after the signals are taken care of

            run(keys_from, lines_to, owner)
        else:
            draw()
    except OSError:
        pass  # the terminal or the other process has gone
    finally:
        if before is not None:
            termios.tcsetattr(keys_from, termios.TCSADRAIN, before)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:4]))
