"""Ctrl-C, SIGTERM and a full disk in the middle of the work: nothing half-written is left."""

import os
import shutil
import signal
import subprocess
from contextlib import contextmanager

import pytest

from rtec.cli import main

LONG = ["simulate", "--design", "c", "--frequency", "500kHz", "--corrections", "100", "--cycles", "1000000000"]
# a shell that starts pytest in the background lets its children ignore the signal


@pytest.mark.parametrize(
    ("number", "code", "word"), [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")]
)
def test_a_signal_leaves_no_file(tmp_path, monkeypatch, capsys, number, code, word):
    begun = []

    @contextmanager
    def interrupting(label):
        def show(share):
            begun.extend(path.name for path in tmp_path.iterdir())
            signal.raise_signal(number)

        yield show

    monkeypatch.setattr("rtec.cli._console.progress", interrupting)
    assert main([*LONG, "--vcd", str(tmp_path / "wave.vcd"), "--force"]) == code
    assert len(begun) == 1  # the file was being written when the signal came
    assert list(tmp_path.iterdir()) == []
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    out, err = capsys.readouterr()
    assert out == ""
    assert err.splitlines()[-1] == f"rtec: {word}; nothing half-written is left"


@pytest.fixture
def small_disk(tmp_path):
    mount = shutil.which("mount")
    made = mount and subprocess.run(
        [mount, "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(tmp_path)], capture_output=True, check=False
    )
    if not made or made.returncode:
        pytest.skip("a small file system can only be mounted by root")
    yield tmp_path
    subprocess.run(["umount", str(tmp_path)], check=True)


def test_full_disk_leaves_no_file(small_disk, capsys):
    words = ["simulate", "--design", "c", "--frequency", "500kHz", "--corrections", "100", "--cycles", "100000"]
    assert main([*words, "--vcd", str(small_disk / "wave.vcd")]) == 2
    assert list(small_disk.iterdir()) == []
    out, err = capsys.readouterr()
    lines = err.splitlines()
    assert out == ""
    assert len(lines) == 1
    assert "No space left on device" in lines[0]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full on this system")
def test_full_device(capsys):
    words = ["simulate", "--design", "c", "--frequency", "500kHz", "--corrections", "0", "--cycles", "10"]
    assert main([*words, "--vcd", "/dev/full"]) == 2
    assert "No space left on device" in capsys.readouterr().err
