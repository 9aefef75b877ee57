"""Two pseudo-terminals joined in one process: a cable for `slcan` and `serial` where the kernel has no CAN driver.

::

    box ── near (/dev/pts/3) ══ relay ══ (/dev/pts/4) far ── PC

The program that offers the line opens the near end and may keep it; programs at the far end come and go. What is sent
while the other end is closed is dropped, as on an open cable.
"""

from __future__ import annotations

import contextlib
import errno
import os
import select
import stat
import sys
import tempfile
import threading
from collections import deque
from collections.abc import Sequence
from pathlib import Path

from rtec.closing import Closing
from rtec.errors import ArgumentError, LinkError

if sys.platform != "win32":
    import fcntl
    import termios
    import tty

LONGEST_PENDING_BYTES = 8192
"""What the relay keeps for a reader that has stopped reading; more is dropped (300 frames of slcan)."""

READ_BYTES = 4096

WITHOUT_TERMINALS = "use udp_multicast, or slcan with socket://host:port or a pair of virtual serial ports"

SLCAN_OPENS = (b"O\r", b"L\r")
"""Commands of slcan that open the channel, to speak or to listen only."""

POLL_MS = 10
"""Interval at which the relay checks a closed end for a program that has opened it."""


class Line(Closing):
    r"""A line between two terminals, joined by a thread of this process.

    Parameters
    ----------
    name
        Where given, the far end can also be found as `well_known` ``(name)`` while the line is open.
    opened_by
        What a program at the far end writes to open its channel, one of these; before that, nothing is passed on to
        it. Empty: opening the terminal is enough.

    Raises
    ------
    LinkError
        This system has no pseudo-terminals, or the well-known name is taken.
    ArgumentError
        A name that is no plain file name.

    Examples
    --------
    >>> with Line() as line:
    ...     far = os.open(line.far, os.O_RDWR | os.O_NOCTTY)
    ...     near = os.open(line.near, os.O_RDWR | os.O_NOCTTY)
    ...     _ = os.write(near, b"t1230\r")
    ...     os.read(far, 6)
    ...     os.close(near)
    ...     os.close(far)
    b't1230\r'
    """

    def __init__(self, *, name: str | None = None, opened_by: Sequence[bytes] = ()) -> None:
        if sys.platform == "win32":
            raise LinkError("pseudo-terminal", "", "this system has none", WITHOUT_TERMINALS)
        self._published = None if name is None else _Published(name)
        self._wake_in, self._wake_out = -1, -1
        self._ends: tuple[_End, ...] = ()
        try:
            self._ends = (_End(()), _End(opened_by))
            self._wake_in, self._wake_out = os.pipe()
            if self._published is not None:
                self._published.point_to(self._ends[1].path)
        except OSError as error:
            self._release()
            if isinstance(error, LinkError):
                raise
            raise LinkError(
                "pseudo-terminal", "", f"cannot be made ({error.strerror})", "is /dev/pts mounted, and not full?"
            ) from error
        self._thread = threading.Thread(target=self._relay, name="rtec line", daemon=True)
        self._thread.start()

    @property
    def near(self) -> str:
        """Return the device of the end for the program that offers the line."""
        return self._ends[0].path

    @property
    def far(self) -> str:
        """Return the device of the other end."""
        return self._ends[1].path

    @property
    def dropped_bytes(self) -> int:
        """Return what was dropped for want of a reader, both ways."""
        return sum(end.dropped_bytes for end in self._ends)

    def close(self) -> None:
        """Take the line away: programs at both ends see their terminal vanish."""
        if self._wake_out < 0:
            return
        os.write(self._wake_out, b"x")
        self._thread.join()
        self._release()

    def _release(self) -> None:
        if self._published is not None:
            self._published.withdraw()
        for end in self._ends:
            os.close(end.master)
        for descriptor in (self._wake_in, self._wake_out):
            if descriptor >= 0:
                os.close(descriptor)
        self._wake_in = self._wake_out = -1

    def _relay(self) -> None:
        poll = select.poll()
        poll.register(self._wake_in, select.POLLIN)
        while True:
            for end in self._ends:
                # a terminal that nobody holds reports its hang-up without end, so that waiting for it would spin
                if end.held:
                    poll.register(end.master, select.POLLIN | (select.POLLOUT if end.pending else 0))
                else:
                    with contextlib.suppress(KeyError):
                        poll.unregister(end.master)
            events = dict(poll.poll(None if all(end.held for end in self._ends) else POLL_MS))
            if self._wake_in in events:
                return
            near, far = self._ends
            for end, other in ((near, far), (far, near)):
                if not end.held:
                    end.check()
                elif events.get(end.master, 0):
                    end.turn(events[end.master], other)


class _End:
    """One pseudo-terminal: the side that the relay reads and writes, and what waits to be written."""

    def __init__(self, opened_by: Sequence[bytes]) -> None:
        self._opened_by = tuple(opened_by)
        self._said = b""
        self.is_open = not self._opened_by
        self.master, slave = os.openpty()
        self.held = False
        self.pending: deque[bytes] = deque()
        self.pending_bytes = 0
        self.dropped_bytes = 0
        try:
            self.path = os.ttyname(slave)
            tty.setraw(slave)  # 8 bits, no echo, no line editing, no signals
            os.set_blocking(self.master, False)
        except BaseException:
            os.close(self.master)
            raise
        finally:
            os.close(slave)  # from here on a hang-up is reported until somebody opens it

    def check(self) -> None:
        """Check whether a program has opened the terminal."""
        poll = select.poll()
        poll.register(self.master, select.POLLIN)
        # what was written in haste by somebody who has left again is still to be read
        self.held = not any(event & select.POLLHUP and not event & select.POLLIN for _, event in poll.poll(0))

    def turn(self, event: int, other: _End) -> None:
        """Take what was written here to the other end, and write what waits for this one."""
        if event & select.POLLIN:
            try:
                data = os.read(self.master, READ_BYTES)
            except OSError as error:
                if error.errno != errno.EAGAIN:
                    self.hang_up()
                return
            if not self.is_open:
                self._said = (self._said + data)[-READ_BYTES:]
                self.is_open = any(words in self._said for words in self._opened_by)
            other.take(data)
        elif event & (select.POLLHUP | select.POLLERR | select.POLLNVAL):
            self.hang_up()
            return
        if event & select.POLLOUT:
            self.write()

    def take(self, data: bytes) -> None:
        """Write ``data`` here, now or as soon as the reader makes room; drop it where there is none."""
        if not self.held:
            self.check()
        if not self.held or not self.is_open or self.pending_bytes + len(data) > LONGEST_PENDING_BYTES:
            self.dropped_bytes += len(data)
            return
        self.pending.append(data)
        self.pending_bytes += len(data)
        self.write()

    def write(self) -> None:
        """Write what waits, as far as there is room."""
        while self.pending:
            try:
                written = os.write(self.master, self.pending[0])
            except OSError as error:
                if error.errno != errno.EAGAIN:
                    self.hang_up()
                return
            self.pending_bytes -= written
            if written < len(self.pending[0]):
                self.pending[0] = self.pending[0][written:]
                return
            self.pending.popleft()

    def hang_up(self) -> None:
        """Forget what the program that has left did not read, so that the next one starts afresh."""
        self.held = False
        self.is_open, self._said = not self._opened_by, b""
        self.dropped_bytes += self.pending_bytes
        self.pending.clear()
        self.pending_bytes = 0
        with contextlib.suppress(OSError, termios.error):
            termios.tcflush(self.master, termios.TCIOFLUSH)
            # what lies on the reader's side can be thrown away from there only
            slave = os.open(self.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            try:
                termios.tcflush(slave, termios.TCIOFLUSH)
            finally:
                os.close(slave)


def well_known(name: str) -> Path:
    """Return the place where the far end of a line with that name is found.

    A private folder of the user: ``$XDG_RUNTIME_DIR/rtec``, else ``rtec-UID`` in the folder for temporary files.

    Raises
    ------
    ArgumentError
        A name that is no plain file name.
    LinkError
        The folder cannot be made, or others may write to it.
    """
    if not name or len(name) > 64 or name.startswith(".") or not all(c.isalnum() or c in "._-" for c in name):
        raise ArgumentError("name", repr(name)[:80], "1 to 64 letters, digits, dots, dashes; no dot at the start")
    return _runtime_folder() / name


def find_line(name: str) -> str:
    """Return the device that a line of that name offers at this moment.

    The link alone does not tell: after a crash it may point to a terminal that is somebody else's by now.

    Raises
    ------
    LinkError
        No living process offers such a line.
    ArgumentError
        A name that is no plain file name.

    Examples
    --------
    >>> with Line(name="doc") as line:
    ...     find_line("doc") == line.far
    True
    """
    if sys.platform == "win32":
        raise LinkError("pseudo-terminal", name, "this system has none", WITHOUT_TERMINALS)
    path = well_known(name)
    missing = LinkError(
        "pseudo-terminal", str(path), "nobody offers this line", "start the box first, or name a channel"
    )
    try:
        lock = os.open(path.with_name(f".{name}.lock"), os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC)
    except OSError:
        raise missing from None
    try:
        fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        try:
            return os.readlink(path)
        except OSError:
            raise missing from None
    finally:
        os.close(lock)
    raise missing


def _runtime_folder() -> Path:
    base = os.environ.get("XDG_RUNTIME_DIR", "")
    if base and os.path.isdir(base) and os.access(base, os.W_OK):
        folder = Path(base) / "rtec"
    else:
        folder = Path(tempfile.gettempdir()) / f"rtec-{os.getuid()}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except OSError as error:
        raise LinkError(
            "pseudo-terminal", str(folder), f"the folder cannot be made ({error.strerror})", "set XDG_RUNTIME_DIR"
        ) from None
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or found.st_mode & 0o077:
        raise LinkError(
            "pseudo-terminal", str(folder), "the folder belongs to, or is open to, somebody else",
            "remove it, or set XDG_RUNTIME_DIR to a folder of your own",
        )  # fmt: skip
    return folder


class _Published:
    """The well-known name of a line, held by a lock that dies with the process that holds it."""

    def __init__(self, name: str) -> None:
        self.path = well_known(name)
        self._lock_path = self.path.with_name(f".{name}.lock")
        self._lock = self._take_lock()

    def _take_lock(self) -> int:
        while True:
            lock = os.open(self._lock_path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                # whoever held it may have removed the file between our two steps
                if os.path.samestat(os.fstat(lock), os.stat(self._lock_path)):
                    os.truncate(lock, 0)
                    os.write(lock, str(os.getpid()).encode())
                    return lock
            except BlockingIOError:
                owner = os.read(lock, 20).decode(errors="replace")
                os.close(lock)
                raise LinkError(
                    "pseudo-terminal", str(self.path), f"the name is in use by process {owner}", "choose another name"
                ) from None
            except FileNotFoundError:
                pass
            os.close(lock)

    def point_to(self, device: str) -> None:
        """Let the name point to a device; what a process that was killed has left is replaced."""
        if self.path.is_symlink():
            self.path.unlink()
        elif self.path.exists():
            problem = "is there already and is no link of ours"
            self.withdraw()
            raise LinkError("pseudo-terminal", str(self.path), problem, "remove it, or choose another name")
        self.path.symlink_to(device)

    def withdraw(self) -> None:
        """Remove name and lock."""
        if self._lock < 0:
            return
        with contextlib.suppress(OSError):
            if self.path.is_symlink():
                self.path.unlink()
        with contextlib.suppress(OSError):
            self._lock_path.unlink()
        os.close(self._lock)
        self._lock = -1
