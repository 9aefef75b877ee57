"""A program of rtec in a terminal of its own."""

import subprocess
import sys
import time

PATIENCE_S = 300.0
"""A fresh machine compiles first."""


class Terminal:
    """A process of rtec, and what it has said so far.

    Parameters
    ----------
    folder
        Where it runs.
    words
        Behind ``rtec``.
    """

    def __init__(self, folder, *words):
        self.file = folder / f"said-{time.monotonic_ns()}"
        with self.file.open("wb") as said:
            self.process = subprocess.Popen(
                [sys.executable, "-u", "-m", "rtec", *words],
                cwd=folder, stdin=subprocess.PIPE, stdout=said, stderr=subprocess.STDOUT,
            )  # fmt: skip

    @property
    def said(self):
        return self.file.read_text(encoding="utf-8")

    def wait_for(self, text):
        end_s = time.monotonic() + PATIENCE_S
        while text not in self.said:
            over = self.process.poll() is not None or time.monotonic() > end_s
            assert not over or text in self.said, f"never said {text!r}: {self.said}"
            time.sleep(0.02)

    def type(self, text):
        self.process.stdin.write(f"{text}\n".encode())
        self.process.stdin.flush()

    def ended(self, number=None):
        """Return its exit code, after a signal where one is given."""
        if number is not None:
            self.process.send_signal(number)
        return self.process.wait(PATIENCE_S)

    def close(self):
        self.process.kill()  # does nothing where it has ended
        self.process.wait()
        self.process.stdin.close()
