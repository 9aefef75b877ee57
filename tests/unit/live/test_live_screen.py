"""The process that owns the terminal: what is typed goes on, and the terminal is put in order at the end."""

import json
import os
import re
import select
import subprocess
import sys
import time

import pytest

from rtec.live.incoming import document_line, say_line

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")

PATIENCE_S = 120.0
AXIS = {"axis": 1, "held": False, "words": "all is well", "cells": {"position": "1 mm"}}


class Terminal:
    """A terminal with the process that owns it, and hands at the keyboard."""

    def __init__(self, folder):
        import fcntl
        import struct
        import termios

        self.master, self.slave = os.openpty()
        fcntl.ioctl(self.slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
        self.lines_from, lines_to = os.pipe()
        self.shown = ""
        self.process = subprocess.Popen(
            [sys.executable, "-m", "rtec.live.screen_process", str(self.slave), str(lines_to), str(os.getpid())],
            stdin=subprocess.PIPE,
            stdout=self.slave,
            pass_fds=(self.slave, lines_to),
            env=os.environ | {"TERM": "xterm", "XDG_STATE_HOME": str(folder)},
        )
        os.close(lines_to)

    @property
    def echoes(self):
        import termios

        return bool(termios.tcgetattr(self.slave)[3] & termios.ECHO)

    def tell(self, line):
        self.process.stdin.write(line)
        self.process.stdin.flush()

    def wait_for(self, text):
        """Wait until a text stands there that was not there before; return what came up to its end."""
        begun = len(self.shown)
        while text not in (come := re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", self.shown[begun:])):
            assert select.select([self.master], [], [], PATIENCE_S)[0], come
            self.shown += os.read(self.master, 65536).decode()
        return come

    def type(self, keys):
        os.write(self.master, keys.encode())

    def line(self):
        assert select.select([self.lines_from], [], [], PATIENCE_S)[0]
        return os.read(self.lines_from, 1000).decode()

    def earlier(self):
        """Press up until the orders of before are there, which are loaded beside what is typed; send the last."""
        for _ in range(1000):
            self.type("\x1b[A\r")
            if (line := self.line()).strip():
                return line
            time.sleep(0.05)  # they are loaded anew while nothing is typed
        return ""

    def wait_until(self, true):
        end_s = time.monotonic() + PATIENCE_S
        while not true():
            assert time.monotonic() < end_s
            time.sleep(0.01)

    def close(self):
        self.process.kill()
        self.process.wait()
        self.process.stdin.close()
        for descriptor in (self.master, self.slave, self.lines_from):
            os.close(descriptor)


@pytest.fixture
def terminal(tmp_path):
    terminals = []

    def open_one():
        terminals.append(Terminal(tmp_path))
        return terminals[-1]

    yield open_one
    for each in terminals:
        each.close()


def test_terminal_is_given_back_when_the_other_process_dies(terminal):
    screen = terminal()
    assert screen.echoes
    screen.wait_for("> go 12 mm, home")
    assert not screen.echoes
    screen.tell(document_line({"title": "t", "axes": [AXIS], "events": []}))
    screen.wait_for("all is well")
    screen.type("home\n")
    assert screen.line() == "home\n"
    screen.process.send_signal(2)  # Ctrl-C is for the other process
    assert screen.process.poll() is None
    screen.process.stdin.close()  # as when that is killed
    screen.wait_until(lambda: screen.echoes)
    assert screen.process.wait(PATIENCE_S) == 0


def test_a_line_is_edited_while_events_pass_above_it(terminal):
    screen = terminal()
    screen.wait_for("> go 12 mm, home")
    screen.type("go 5 mn")
    screen.wait_for("go 5 mn")
    screen.tell(say_line("axis 1: something has happened"))
    come = screen.wait_for("> go 5 mn")  # what is typed stands there again, below what has happened
    assert come.index("something has happened") < come.index("> go 5 mn")
    screen.type("\x7fm at 60 mm/min\x01axis 2 \r")  # backspace; Ctrl-A: to the beginning of the line
    assert screen.line() == "axis 2 go 5 mm at 60 mm/min\n"


def test_orders_are_remembered_from_one_run_to_the_next(terminal):
    screen = terminal()
    screen.wait_for("> go 12 mm, home")
    screen.type("hone\r")
    assert screen.line() == "hone\n"
    assert screen.earlier() == "hone\n"
    screen.process.stdin.close()
    assert screen.process.wait(PATIENCE_S) == 0
    later = terminal()
    later.wait_for("> go 12 mm, home")
    assert later.earlier() == "hone\n"


def test_tab_completes_and_the_end_of_input_quits(terminal):
    screen = terminal()
    screen.wait_for("> go 12 mm, home")
    screen.type("switch of")
    screen.wait_for("switch of")
    screen.type("\t")
    screen.wait_for("f")
    screen.type("\r")
    assert screen.line() == "switch off\n"
    screen.type("\x04")
    assert screen.line() == "quit\n"


def test_interrupt_reaches_the_other_process(terminal):
    import signal

    heard = []
    before = signal.signal(signal.SIGINT, lambda number, frame: heard.append(number))
    try:
        screen = terminal()
        screen.wait_for("> go 12 mm, home")
        screen.type("\x03")
        screen.wait_until(lambda: heard)
    finally:
        signal.signal(signal.SIGINT, before)
    assert screen.process.poll() is None


def test_a_box_on_a_terminal_is_typed_at(tmp_path):
    """The whole way: keys, prompt, order, event above the prompt, report."""
    import pty

    words = ["box", "--channel", f"typed-{os.getpid()}", "--stand", "--json"]
    reading, report_to = os.pipe()
    pid, master = pty.fork()
    if pid == 0:
        os.dup2(report_to, 1)
        os.environ |= {"TERM": "xterm", "XDG_STATE_HOME": str(tmp_path)}
        os.execv(sys.executable, [sys.executable, "-m", "rtec", *words])  # noqa: S606 - as a terminal starts it
    os.close(report_to)
    shown = ""

    def wait_for(text):
        nonlocal shown
        begun = len(shown)
        while text not in shown[begun:]:
            assert select.select([master], [], [], PATIENCE_S)[0], shown
            shown += os.read(master, 65536).decode()

    try:
        wait_for("go 12 mm, home")  # drawn on stderr, as stdout is for the document
        os.write(master, b"hone\r")
        wait_for("did you mean 'home'?")
        os.write(master, b"switch off\r")
        wait_for("order: switch off")
        os.write(master, b"quit\r")
        wait_for("ended: quit")
        with os.fdopen(reading) as file:
            report = json.loads(file.read())
    finally:
        os.close(master)
        _, status = os.waitpid(pid, 0)
    assert os.waitstatus_to_exitcode(status) == 0  # whoever types may mistype
    assert (report["ended"], report["orders_refused"]) == ("quit", [])
