"""Logs of the bus written and read: candump (`.log`), ASC (`.asc`, absolute times) and BLF (`.blf`).

Every frame is in the file before the next one, so that a crash leaves a log that can be read.
"""

from __future__ import annotations

import contextlib
import enum
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO, TextIO, cast

import can

from rtec.closing import Closing
from rtec.errors import ArgumentError, FileFormatError, OutputError, nearest
from rtec.io import unreadable
from rtec.link._log_formats import Direction, Logged, read_asc, read_blf, read_candump
from rtec.link.frame import Frame
from rtec.link.transport import BusState, Received, Traffic, Transport
from rtec.units import PS_PER_S

SIMULATED_ZERO_UNIX_S = 946_684_800.0
"""1 January 2000: where simulated time begins in a log, since BLF holds no date before 1990."""

_BLF_FRAME_BYTES = 48
"""Of one classic frame as an object of BLF: so large a container is written as soon as it holds one."""

_LONGEST_PS = 9 * 10**18

_READERS = {".log": read_candump, ".asc": read_asc, ".blf": read_blf}


class Existing(enum.Enum):
    """What to do with an existing file."""

    REFUSE = "refuse"
    REPLACE = "replace"


def wall_zero_unix_s(transport: Transport) -> float:
    """Return the Unix time at which the transport's clock was zero, for logs of live buses."""
    return time.time() - transport.now_ps() / PS_PER_S


def _suffix(path: Path) -> str:
    suffix = path.suffix.lower()
    if suffix not in _READERS:
        hint = nearest(suffix, _READERS)
        raise ArgumentError("log", path, "a name that ends in .log (candump), .asc or .blf", hint)
    return suffix


class Log(Closing):
    r"""A log that is being written.

    Parameters
    ----------
    path
        The file; its suffix chooses the format.
    zero_unix_s
        Unix time at which the clock of the frames is zero: `wall_zero_unix_s` for a live bus.
    existing
        Whether a file that is there already is replaced.

    Raises
    ------
    ArgumentError
        An unknown suffix.
    OutputError
        The file exists, or cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "trip.log"
    >>> with Log(file) as log:
    ...     log.record(Frame(identifier=0x120, data=b"\x01"), 5 * PS_PER_S, Direction.SENT)
    >>> file.read_text()
    '(946684805.000000) can0 120#01 T\n'
    """

    def __init__(
        self,
        path: str | Path,
        *,
        zero_unix_s: float = SIMULATED_ZERO_UNIX_S,
        existing: Existing = Existing.REFUSE,
    ) -> None:
        self._path = Path(path)
        self._suffix = _suffix(self._path)
        self._zero_unix_s = zero_unix_s
        self._begun = False
        self._writer: can.CanutilsLogWriter | can.ASCWriter | can.BLFWriter | None = None
        try:
            self._writer = self._create("w" if existing is Existing.REPLACE else "x")
        except FileExistsError:
            raise OutputError(
                f"{path}: there is a file already; name another one, or ask for it to be replaced"
            ) from None
        except (OSError, ValueError) as error:
            raise self._unwritable(error) from error

    def record(self, frame: Frame, time_ps: int, direction: Direction) -> None:
        """Write a frame.

        Raises
        ------
        OutputError
            The disk is full, or the log is closed.
        """
        if self._writer is None:
            raise OutputError(f"{self._path}: the log is closed; open another one")
        message = can.Message(
            timestamp=self._zero_unix_s + time_ps / PS_PER_S,
            arbitration_id=frame.identifier,
            data=frame.data,
            is_extended_id=frame.extended,
            is_rx=direction is Direction.RECEIVED,
        )
        try:
            self._writer.on_message_received(message)
            if isinstance(self._writer, can.BLFWriter):
                self._writer = self._go_on(self._writer)
            self._writer.file.flush()
        except (OSError, ValueError) as error:
            raise self._unwritable(error) from error

    def close(self) -> None:
        """Finish the log; closing twice does nothing.

        Raises
        ------
        OutputError
            The end could not be written.
        """
        writer, self._writer = self._writer, None
        if writer is None:
            return
        try:
            writer.stop()
        except (OSError, ValueError) as error:
            with contextlib.suppress(OSError):
                writer.file.close()
            raise self._unwritable(error) from error

    def _create(self, mode: str) -> can.CanutilsLogWriter | can.ASCWriter | can.BLFWriter:
        if self._suffix != ".blf":
            text = cast(TextIO, open(self._path, mode, encoding="utf-8", newline="\n"))
            return can.ASCWriter(text) if self._suffix == ".asc" else can.CanutilsLogWriter(text, channel="can0")
        file = cast(BinaryIO, open(self._path, mode + "b"))
        try:
            writer = can.BLFWriter(file)
            file.flush()
        except BaseException:
            with contextlib.suppress(OSError):
                file.close()
            raise
        return writer

    def _go_on(self, writer: can.BLFWriter) -> can.BLFWriter:
        """Put the first frame's date into the file's head, which python-can writes at the end only."""
        if self._begun:
            return writer
        self._begun = True
        writer.stop()
        following = can.BLFWriter(self._path, append=True, compression_level=0)
        following.max_container_size = _BLF_FRAME_BYTES
        return following

    def _unwritable(self, error: Exception) -> OutputError:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        return OutputError(
            f"{self._path}: the log cannot be written: {reason}; free some space or choose another folder"
        )


class Recorded(Closing):
    """A transport whose frames, sent and received, are written to a log.

    Parameters
    ----------
    transport
        The way to the bus; closing this closes it and the log.
    log
        Where it is written.
    """

    def __init__(self, transport: Transport, log: Log) -> None:
        self._transport, self._log = transport, log

    @property
    def state(self) -> BusState:
        """Return how the bus is."""
        return self._transport.state

    @property
    def traffic(self) -> Traffic:
        """Return what has been counted."""
        return self._transport.traffic

    def now_ps(self) -> int:
        """Return the time on the transport's clock."""
        return self._transport.now_ps()

    def send(self, frame: Frame) -> None:
        """Send a frame and, where it found room, write it down; errors as those of the transport and the log."""
        unsent = self._transport.traffic.unsent
        now_ps = self._transport.now_ps()
        self._transport.send(frame)
        if self._transport.traffic.unsent == unsent:
            self._log.record(frame, now_ps, Direction.SENT)

    def receive(self, until_ps: int) -> Received | None:
        """Return the next frame as the transport does, written down; errors as those of the transport and the log."""
        received = self._transport.receive(until_ps)
        if received is not None:
            self._log.record(received.frame, received.arrival_ps, Direction.RECEIVED)
        return received

    def close(self) -> None:
        """Leave the bus and finish the log."""
        try:
            self._transport.close()
        finally:
            self._log.close()


def read_log(path: str | Path) -> Iterator[Logged]:
    r"""Read the classic data frames of a log one by one, in bounded memory; others are passed over.

    Parameters
    ----------
    path
        A file that ends in .log (candump -L), .asc or .blf.

    Raises
    ------
    ArgumentError
        An unknown suffix.
    FileFormatError
        While reading: the file cannot be read, is of another format, or is cut off; the frames before come first.

    Examples
    --------
    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "trip.log"
    >>> _ = file.write_text("(1.000000) can0 120#01\n(1.010000) can0 121#")
    >>> frames = list(read_log(file))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    rtec.errors.FileFormatError: ...trip.log, line 2: the log is cut off: '(1.010000) can0 121#' has no end; 1 ...
    """
    log = Path(path)
    read = _READERS[_suffix(log)]
    if log.exists() and not log.is_file():  # reading a pipe would block
        raise FileFormatError(path, None, "this is no regular file", "a log")
    return _since_the_first(log, read(log))


def _since_the_first(path: Path, log: Iterator[Logged]) -> Iterator[Logged]:
    """Yield frames at their times since the first one; an error says how many came before it."""
    frames, zero_ps = 0, 0
    try:
        for logged in log:
            zero_ps = zero_ps if frames else logged.time_ps
            if abs(logged.time_ps - zero_ps) > _LONGEST_PS:
                raise FileFormatError(path, None, "a frame lies 104 days off the first", "a shorter log")
            frames += 1
            yield replace(logged, time_ps=logged.time_ps - zero_ps)
    except FileFormatError as error:
        whole = f"{frames} frame{'' if frames == 1 else 's'} before it read well"
        raise FileFormatError(path, error.line, f"{error.problem}; {whole}", error.allowed) from None
    except OSError as error:
        raise unreadable(path, error, "a log") from None
