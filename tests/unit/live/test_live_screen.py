"""The process that owns the terminal: what is typed goes on, and the terminal is put in order at the end."""

import json
import os
import subprocess
import sys
import time

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")

PATIENCE_S = 60.0


def wait_until(true):
    end_s = time.monotonic() + PATIENCE_S
    while not true():
        assert time.monotonic() < end_s
        time.sleep(0.01)


def test_terminal_is_given_back_when_the_other_process_dies():
    import select
    import termios

    master, slave = os.openpty()
    lines_from, lines_to = os.pipe()

    def echoes():
        return bool(termios.tcgetattr(slave)[3] & termios.ECHO)

    assert echoes()
    process = subprocess.Popen(
        [sys.executable, "-m", "rtec.live.screen_process", str(slave), str(lines_to)],
        stdin=subprocess.PIPE,
        stdout=slave,
        pass_fds=(slave, lines_to),
        env=os.environ | {"TERM": "xterm"},
    )
    try:
        wait_until(lambda: not echoes())
        axis = {"axis": 1, "held": False, "words": "all is well", "cells": {"position": "1 mm"}}
        process.stdin.write(json.dumps({"title": "t", "axes": [axis], "events": [], "prompt": ""}).encode() + b"\n")
        process.stdin.flush()
        shown = b""
        while b"all is well" not in shown:
            assert select.select([master], [], [], PATIENCE_S)[0]
            shown += os.read(master, 65536)
        os.write(master, b"home\n")
        assert select.select([lines_from], [], [], PATIENCE_S)[0]
        assert os.read(lines_from, 100) == b"home\n"
        process.send_signal(2)  # Ctrl-C is for the other process
        assert process.poll() is None
        process.stdin.close()  # as when that is killed
        wait_until(echoes)
        assert process.wait(PATIENCE_S) == 0
    finally:
        process.kill()
        process.wait()
        for descriptor in (master, slave, lines_from, lines_to):
            os.close(descriptor)
