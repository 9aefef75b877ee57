"""The prompt of a box: a line that is always there to be typed in, the picture above it, what happens above both.

It runs in the process that owns the terminal (`screen_process`).
"""

from __future__ import annotations

import asyncio
import functools
import os
import signal
from pathlib import Path
from typing import Any

from prompt_toolkit import Application
from prompt_toolkit.application import run_in_terminal
from prompt_toolkit.buffer import Buffer
from prompt_toolkit.completion import WordCompleter
from prompt_toolkit.data_structures import Size
from prompt_toolkit.filters import Condition
from prompt_toolkit.formatted_text import ANSI, AnyFormattedText
from prompt_toolkit.history import FileHistory, History, InMemoryHistory
from prompt_toolkit.input import Input, create_input
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.layout import (
    BufferControl,
    ConditionalContainer,
    FormattedTextControl,
    HSplit,
    Layout,
    Window,
)
from prompt_toolkit.layout.processors import AfterInput, BeforeInput
from prompt_toolkit.output import Output
from prompt_toolkit.output.vt100 import Vt100_Output

from rtec.live.incoming import Incoming

WORDS = (
    "go", "home", "switch on", "switch off", "power on", "power off", "restart", "trip", "fault", "clear", "wait",
    "status", "help", "quit",
)  # fmt: skip
"""What Tab completes; this process does not load the code that knows the faults by name."""

HINT = "go 12 mm, home, switch, power, restart, trip, fault, clear, wait, status, help, quit"

HISTORY_FILE = "box-orders"


def history_file() -> Path:
    """Return where orders are remembered from one run to the next: ``$XDG_STATE_HOME/rtec``."""
    base = os.environ.get("XDG_STATE_HOME", "")
    return (Path(base) if base else Path.home() / ".local" / "state") / "rtec" / HISTORY_FILE


def _history() -> History:
    """Return the orders of earlier runs; those of this one only, where they cannot be kept."""
    try:
        file = history_file()
        file.parent.mkdir(parents=True, exist_ok=True)
        file.open("ab").close()
    except (OSError, RuntimeError):  # no home
        return InMemoryHistory()
    return FileHistory(file)


class Prompt:
    """The line to type in and what stands above it.

    Parameters
    ----------
    incoming
        What the other process wants to be shown.
    lines_to
        File descriptor to which typed lines are written.
    owner
        Number of the process that Ctrl-C is for.
    keyboard, terminal
        Where keys come from, and where it is drawn.
    """

    def __init__(self, incoming: Incoming, lines_to: int, owner: int, keyboard: Input, terminal: Output) -> None:
        self._incoming, self._lines_to, self._owner = incoming, lines_to, owner
        self._picture = ""
        self.application = self._application(keyboard, terminal)

    async def run(self) -> None:
        """Take what is typed and show what comes, until nothing more comes."""
        loop = asyncio.get_running_loop()
        printing: asyncio.Queue[list[str]] = asyncio.Queue()

        def take() -> None:
            said, document, ended = self._incoming.take()
            if said:
                printing.put_nowait(said)
            if document is not None:
                self._picture = self._drawn(document)
            if ended:
                loop.remove_reader(self._incoming.descriptor)
                printing.put_nowait([])
            self.application.invalidate()

        def begin() -> None:
            loop.add_reader(self._incoming.descriptor, take)
            self.application.create_background_task(self._print(printing))

        await self.application.run_async(pre_run=begin, handle_sigint=False)

    async def _print(self, printing: asyncio.Queue[list[str]]) -> None:
        """Write lines above the prompt; none at all end it."""
        output = self.application.output
        while lines := await printing.get():
            await run_in_terminal(functools.partial(_write, output, lines))
        self.application.exit()

    def _drawn(self, document: dict[str, Any]) -> str:
        from rich.console import Console  # noqa: PLC0415 - only where something is drawn

        from rtec.live.picture import picture  # noqa: PLC0415 - as above

        width = self.application.output.get_size().columns
        console = Console(width=width, force_terminal=True, highlight=False)
        with console.capture() as drawn:
            console.print(picture(document, width=width))
        return drawn.get().rstrip("\n")

    def _send(self, line: str) -> None:
        os.write(self._lines_to, f"{line}\n".encode())

    def _application(self, keyboard: Input, terminal: Output) -> Application[None]:
        def accept(buffer: Buffer) -> bool:
            self._send(buffer.text)
            return False  # the line is emptied for the next one

        buffer = Buffer(
            accept_handler=accept,
            history=_history(),
            multiline=False,
            completer=WordCompleter(WORDS, sentence=True),
        )

        def hint() -> AnyFormattedText:
            return "" if buffer.text else [("fg:ansibrightblack", HINT)]

        line = BufferControl(buffer, input_processors=[BeforeInput("> "), AfterInput(hint)])
        above = Window(FormattedTextControl(lambda: ANSI(self._picture)), dont_extend_height=True)
        shown = ConditionalContainer(above, filter=Condition(lambda: bool(self._picture)))
        return Application(
            layout=Layout(HSplit([shown, Window(line, height=1)]), focused_element=line),
            key_bindings=self._keys(buffer),
            input=keyboard,
            output=terminal,
        )

    def _keys(self, buffer: Buffer) -> KeyBindings:
        keys = KeyBindings()

        @keys.add("c-c")
        def interrupt(event: KeyPressEvent) -> None:
            if os.getppid() == self._owner:
                os.kill(self._owner, signal.SIGINT)

        @keys.add("c-d")
        def leave(event: KeyPressEvent) -> None:
            if buffer.text:
                buffer.delete()
            else:
                self._send("quit")

        @keys.add("c-z")
        def suspend(event: KeyPressEvent) -> None:
            event.app.suspend_to_background()

        return keys


def _write(output: Output, lines: list[str]) -> None:
    output.write_raw("".join(f"{line}\r\n" for line in lines))
    output.flush()


def run(keys_from: int, lines_to: int, owner: int) -> None:
    """Show a prompt until nothing more comes on standard input."""
    with open(keys_from, closefd=False) as keys, open(1, "w", closefd=False) as terminal:

        def size() -> Size:
            columns, rows = os.get_terminal_size(1)
            return Size(rows=rows or 24, columns=columns or 80)

        # nothing is asked of the terminal: an answer that comes too late would be typed into the shell
        output = Vt100_Output(terminal, size, term=os.environ.get("TERM"), enable_cpr=False)
        asyncio.run(Prompt(Incoming(0), lines_to, owner, create_input(keys), output).run())
