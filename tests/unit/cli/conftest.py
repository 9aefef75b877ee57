"""A live box for the commands that speak to one, and checks in short."""

import os
import threading
import time

import pytest

from rtec.conformance.endurance import Endured


@pytest.fixture
def on_a_bus():
    """Put a station on a virtual bus of its own, in a thread; returns the channel."""
    from rtec.link.python_can import open_transport
    from rtec.live.box_loop import BoxLoop

    ends, running = threading.Event(), []

    def put(station):
        channel = f"box-{os.getpid()}-{time.monotonic_ns()}"
        transport = open_transport(interface="virtual", channel=channel)
        loop = BoxLoop([station], transport)

        def run():
            while not ends.is_set():
                loop.step()

        thread = threading.Thread(target=run)
        thread.start()
        running.append((thread, transport))
        return channel

    yield put
    ends.set()
    for thread, transport in running:
        thread.join()
        transport.close()


@pytest.fixture
def no_speeds(monkeypatch):
    """Leave out how fast and how deep it goes, most of the time of a check."""
    none = Endured(wrong=None, made=1, depth=0, limit="")
    monkeypatch.setattr("rtec.conformance.suite.endure", lambda trials, kind: none)
    monkeypatch.setattr("rtec.conformance.suite._Suite._speeds", lambda self, parts: None)
