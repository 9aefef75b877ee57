"""Commands carried out here, a live box for those that speak to one, and checks in short."""

import json
import os
import threading
import time

import pytest

from rtec.cli import main
from rtec.verify.contract.endurance import Endured


@pytest.fixture
def said(request, capsys):
    """Carry out a command, the words behind the ``VERB`` of the module; returns exit code, stdout and stderr."""

    def carry_out(*words):
        capsys.readouterr()
        code = main([request.module.VERB, *map(str, words)])
        return code, *capsys.readouterr()

    return carry_out


@pytest.fixture
def answer(said):
    """Carry out a command that is done and prints one document; returns that."""

    def document(*words):
        code, out, err = said(*words, "--json")
        assert (code, err, out.count("\n")) == (0, "", 1)
        return json.loads(out, parse_constant=pytest.fail)

    return document


@pytest.fixture
def refused(said):
    """Carry out a command that refuses its words or files, in one line; returns that."""

    def line(*words):
        code, out, err = said(*words)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert err.startswith("rtec: ")
        return err

    return line


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
    monkeypatch.setattr("rtec.verify.contract.suite.endure", lambda trials, kind: none)
    monkeypatch.setattr("rtec.verify.contract.suite.measure_speeds", lambda *_: None)
