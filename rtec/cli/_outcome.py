"""How a command ends: every error becomes one line on stderr and an exit code."""

from __future__ import annotations

import codecs
import errno
import os
import signal
import sys
import threading
import traceback
import unicodedata
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, TextIO

from rtec.errors import RtecError, nearest

BAD_INPUT = 2
INTERNAL = 70
"""EX_SOFTWARE of sysexits.h."""
INTERRUPTED = 130
"""128 + SIGINT, as shells have it."""
UNREAD = 141
"""128 + SIGPIPE, as shells have it."""
TERMINATED = 143
"""128 + SIGTERM, as shells have it."""


class _Terminated(SystemExit):
    """SIGTERM; no error, so nothing takes it for one on its way out."""


def exit_code(command: Callable[[], None]) -> int:
    """Carry out ``command``, say in one line what went wrong, and return the exit code.

    Examples
    --------
    >>> exit_code(lambda: None)
    0
    """
    _open_streams()
    try:
        with _unwinding_on_sigterm():
            code = _ended(command)
            sys.stdout.flush()
    except KeyboardInterrupt:
        code = _say("interrupted; nothing half-written is left", INTERRUPTED)
    except _Terminated:
        code = _say("terminated; nothing half-written is left", TERMINATED)
    except SystemExit as ended:
        # rich answers a broken pipe so
        if not isinstance(ended.__context__, BrokenPipeError):
            raise
        code = UNREAD
    except Exception as error:
        code = _explained(error)
    if code != 0:
        _discard_unwritten(sys.stdout)
    return code


@contextmanager
def _unwinding_on_sigterm() -> Iterator[None]:
    """Let SIGTERM, of itself a sudden end, leave every ``with`` block as Ctrl-C does; a second one is ignored."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread can say what a signal does
        return

    def end(number: int, frame: FrameType | None) -> None:
        signal.signal(number, signal.SIG_IGN)
        raise _Terminated(TERMINATED)

    before = signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


_PLAIN = "rtec-plain"
_IN_ASCII = {
    "µ": "u", "μ": "u", "±": "+-", "×": "x", "·": ".", "…": "...", "–": "-", "—": "-", "−": "-", "°": "deg ",
    "→": "->", "←": "<-", "≤": "<=", "≥": ">=", "≈": "~", "²": "^2", "³": "^3", "⁻": "^-", "σ": "sigma", "√": "sqrt",
    "\N{LEFT SINGLE QUOTATION MARK}": "'", "\N{RIGHT SINGLE QUOTATION MARK}": "'", "█": "#", "▇": "#", "━": "=",
    "\N{COMBINING MACRON}": "_mean", "\N{NON-BREAKING HYPHEN}": "-", "\N{FIGURE DASH}": "-", "\N{PRIME}": "'",
    "↑": "^", "↓": "v", "▲": "^", "▼": "v", "▽": "v", "▁": "_", "▔": "-", "─": "-", "═": "=", "⇒": "=>", "⇐": "<=",
    "∞": "inf", "τ": "tau", "½": "1/2", "∛": "cbrt",
}  # fmt: skip
"""How a terminal that knows ASCII only shows the signs of this field."""


def _in_ascii(error: UnicodeError) -> tuple[str, int]:
    """Return what stands for letters that a stream cannot encode: a codec's error handler."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(_spelled(sign) for sign in error.object[error.start : error.end]), error.end


def _spelled(sign: str) -> str:
    r"""Return a sign as it is known, else as its letter without accents, else as its number.

    >>> _spelled("µ"), _spelled("\u016a"), _spelled("ü"), _spelled("Ж")
    ('u', 'U_mean', 'u', '\\u0416')
    """
    if sign in _IN_ASCII or sign.isascii():
        return _IN_ASCII.get(sign, sign)
    parts = unicodedata.normalize("NFKD", sign)
    if parts != sign:
        return "".join(_spelled(part) for part in parts)
    return "" if unicodedata.combining(sign) else sign.encode("ascii", "backslashreplace").decode()


codecs.register_error(_PLAIN, _in_ascii)


def _open_streams() -> None:
    """Give a process started without stdout or stderr somewhere to write; let no letter be unprintable."""
    for name in ("stdout", "stderr"):
        stream: Any = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors=_PLAIN)


def _ended(command: Callable[[], None]) -> int:
    import typer  # Ctrl-C while it loads must meet the handler, too

    # typer keeps the base of its errors in click or in a copy of click, depending on its version
    usage_error: Any = typer.BadParameter.__mro__[2]
    try:
        command()
    except typer.Exit as ended:
        return ended.exit_code
    except typer.Abort:
        raise KeyboardInterrupt from None
    except usage_error as error:
        return _say(_usage(error), BAD_INPUT)
    return 0


def _usage(error: Any) -> str:
    """Return one line for an unknown option, a missing argument and the like."""
    context = getattr(error, "ctx", None)
    message = str(error.format_message()).rstrip(".")
    if context is None:
        return message
    verb = context.command_path.removeprefix("rtec").strip()
    where = f"{verb}: " if verb else ""
    if hasattr(error, "possibilities"):
        known = [name for parameter in context.command.params for name in parameter.opts if name.startswith("--")]
        return f"{where}no option {error.option_name[:60]!r}; {nearest(error.option_name, [*known, '--help'])}"
    return f"{where}{message}; '{context.command_path} --help' shows what is allowed"


def _explained(error: Exception) -> int:
    """Say what an exception means to the user; return its exit code."""
    if os.environ.get("RTEC_DEBUG"):
        traceback.print_exc()
    if isinstance(error, RtecError):
        return _say(str(error), BAD_INPUT)
    if isinstance(error, OSError):
        if error.errno == errno.EPIPE:
            _discard_unwritten(sys.stdout)
            return UNREAD
        where = error.filename if error.filename is not None else "output"
        return _say(f"{where}: {error.strerror or error}", BAD_INPUT)
    if isinstance(error, MemoryError):
        return _say("not enough memory for this; ask for less", BAD_INPUT)
    what = f"{type(error).__name__}: {error}"
    return _say(f"a bug in rtec, please report it: {what}; RTEC_DEBUG=1 shows the traceback", INTERNAL)


def _say(message: str, code: int) -> int:
    """Write one line on stderr; return ``code``."""
    with suppress(OSError, ValueError):
        # what a file says may end up in a message; it must not steer the terminal
        line = "".join(sign if sign.isprintable() else "\ufffd" for sign in " ".join(message.split()))
        sys.stderr.write(f"rtec: {line}\n")
        sys.stderr.flush()
    return code


def _discard_unwritten(stream: TextIO) -> None:
    """Write what can still be written; else drop it, so that the interpreter does not stumble over it at its end."""
    try:
        stream.flush()
    except (OSError, ValueError):
        with suppress(OSError, ValueError):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, stream.fileno())
            os.close(nowhere)
