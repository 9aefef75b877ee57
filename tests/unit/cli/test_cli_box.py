"""rtec box: its words, and its end."""

import json
import os
import signal
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest

from rtec.cli import main
from tests.terminals import PATIENCE_S


def run_box(capsys, *words):
    code = main(["box", "--channel", f"test-{os.getpid()}", "--json", *words])
    out, err = capsys.readouterr()
    return code, json.loads(out), err


def test_duration_ends_it_with_a_report(capsys, tmp_path):
    log = tmp_path / "bus.log"
    code, report, err = run_box(
        capsys, "--duration", "300ms", "--axes", "2", "--design", "c", "--seed", "4", "--log", str(log)
    )
    assert code == 0
    assert report["ended"] == "duration"
    assert [axis["axis"] for axis in report["axes"]] == [1, 2]
    assert [axis["status"] for axis in report["axes"]] == ["NOT_HOMED", "NOT_HOMED"]
    # one session after the other, from the seed on
    assert (report["axes"][1]["session"] - report["axes"][0]["session"]) % 256 == 1
    assert f"rtec pc --channel test-{os.getpid()} --axes 2 --design c" in err
    identifiers = {line.split()[2][:3] for line in log.read_text().splitlines()}
    assert {"181", "182", "301", "302"} <= identifiers


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--axis", "16"], "--axis: 16 is too large; use 1 to 15"),
        (["--axis", "1", "--axes", "2"], "--axes does not go with --axis"),
        (["--design", "d"], "design: 'd'"),
        (["--timing", "firm"], "did you mean 'firmware'?"),
        (["--timing", "firmware", "--window", "5"], "--window: window 5, grace 2"),
        (["--count", "1"], "--count: '1'"),
        (["--speed", "0"], "--speed: '0'"),
        (["--watchdog", "20ms"], "--watchdog: "),
        (["--cycle", "100us"], "--cycle: "),
        (["--window", "0"], "--window: 0"),
        (["--limit", "-1"], "--limit: -1"),
        (["--duration", "0s"], "--duration: 0s"),
        (["--bitrate", "500000"], "--bitrate"),
        (["--interface", "virtual"], "--channel is missing; give the channel of the interface, such as"),
        (["--interface", "socketcam", "--channel", "can0"], "did you mean 'socketcan'?"),
        (["--interface", "slcan", "--channel", "/dev/none"], "/dev/none: cannot be opened"),
        (["--interface", "virtual", "--channel", "a", "--bitrate", "fast"], "--bitrate: 'fast'"),
        (["--program", "none.nc"], "none.nc: there is no such file"),
        (["--log", "bus.txt"], "a name that ends in .log, .asc or .blf"),
        (["--channel", "../x"], "name: '../x'"),
        (["--stand", "--program", "none.nc"], "does not go with --stand"),
        (["--algorithm", "none.py:Mine"], "--design beside it"),
        (["--algorithm", "none.py:Mine", "--design", "c"], "none.py: no such file"),
        (["--algorithm", "none.py:Mine", "--timing", "fast"], "--timing does not go with --algorithm"),
        (["--dbc", "steers.dbc"], "\ufffd[31m"),
    ],
)
def test_bad_words_are_refused_in_one_line(capsys, monkeypatch, tmp_path, words, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "steers.dbc").write_text("\x1b[31mred \x07\n")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))  # lines of its own: somebody may have a box running
    assert main(["box", "--duration", "1s", *words]) == 2
    _, err = capsys.readouterr()
    lines = [line for line in err.splitlines() if "another terminal" not in line]
    assert len(lines) == 1 and said in lines[0], err


def test_a_class_of_ones_own_works_in_the_box_and_what_it_prints_is_no_result(capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    (tmp_path / "mine.py").write_text(
        "class Mine:\n    kept = {}\n    def step(self, t_ps, ab, requested):\n"
        "        print('a call')\n        return ab, 7, 0\n"
    )
    words = [
        "--algorithm",
        f"{tmp_path}/mine.py:Mine",
        "--design",
        "a",
        "--interface",
        "virtual",
        "--channel",
        "own",
        "--duration",
        "200ms",
        "--json",
    ]
    assert main(["box", *words]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["axes"][0]["completed"] == 7
    assert "a call" in err
    assert "runs as plain Python, slower: attribute kept is no number" in err


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
def test_two_terminals(terminal):
    """Box and PC in two processes, each killed once: the other says what happened, and both get going again."""
    line = ["--channel", f"pair-{os.getpid()}", "--cycle", "100ms"]
    box = terminal("box", *line)
    box.wait_for("not homed: at home it waits for a PC")
    pc = terminal("pc", *line)
    pc.wait_for("every axis is homed and corrected")
    box.wait_for("corrections follow the PC's requests")
    pc.ended(signal.SIGKILL)
    box.wait_for("stopped for good, hold contact open: no valid request from the PC")
    box.type("home")
    box.wait_for("order: home")
    pc = terminal("pc", *line, "--reset")
    pc.wait_for("every axis is homed and corrected")
    box.ended(signal.SIGKILL)
    pc.wait_for("BOX_SILENT")
    assert "the line is gone: the box's program has ended or was killed" in pc.said
    assert pc.ended() == 1
    pc = terminal("pc", *line)
    pc.wait_for("waiting up to")  # a box that comes later
    box = terminal("box", *line)
    pc.wait_for("every axis is homed and corrected")
    assert pc.ended(signal.SIGTERM) == 0
    box.wait_for("a PC on the bus holds the machine")
    assert box.ended(signal.SIGINT) == 0
    assert "ended: Ctrl-C" in box.said
    assert not Path(os.environ.get("XDG_RUNTIME_DIR", "/nowhere"), "rtec", line[1]).exists()


HERE = "in another terminal: PC"
ALONE = "no other program can join: a virtual bus of python-can ends where its process does"
BUS = 'or in Python: can.Bus(interface="'
DBC = f"messages: {files('rtec.link') / 'rtec.dbc'}"


@pytest.mark.parametrize(
    ("interface", "channel", "rate", "said"),
    [
        (None, None, None, [HERE, f'{BUS}slcan", channel="FAR/rtec", sleep_after_open=0)', DBC]),
        (None, "two", None, [HERE, f'{BUS}slcan", channel="FAR/two", sleep_after_open=0)', DBC]),
        ("udp_multicast", "239.74.163.2", None, [HERE, f'{BUS}udp_multicast", channel="239.74.163.2")', DBC]),
        ("socketcan", "can0", None, [HERE, f'{BUS}socketcan", channel="can0")', DBC]),
        (
            "slcan", "/dev/ttyACM0", "500000",
            [
                "with the other side's own adapter as CHANNEL: PC",
                f'{BUS}slcan", channel="CHANNEL", bitrate=500000)',
                DBC,
            ],
        ),
        ("virtual", "x", None, [ALONE]),
    ],
)  # fmt: skip
def test_the_ways_in_are_those_of_the_interface(monkeypatch, tmp_path, interface, channel, rate, said):
    from rtec.cli._live import BusWords

    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    bus = BusWords(interface=interface, channel=channel, bitrate=rate)
    assert [line.replace(str(tmp_path / "rtec"), "FAR") for line in bus.ways_in("PC")] == said


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
def test_a_script_with_mistakes_is_done_to_its_end_and_fails():
    words = [sys.executable, "-m", "rtec", "box", "--channel", f"script-{os.getpid()}", "--json"]
    orders = "switch off\n\nhone\naxis 7 home\nswitch on\nquit\n"
    done = subprocess.run(words, input=orders, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    report = json.loads(done.stdout)
    assert (done.returncode, report["ended"]) == (1, "quit")
    assert [(one["line"], one["order"]) for one in report["orders_refused"]] == [(3, "hone"), (4, "axis 7 home")]
    told = done.stderr.splitlines()[-2:]
    assert told[0].startswith("rtec: line 3 of the orders, 'hone', was not done: order: 'hone' is not an order; use ")
    assert told[0].endswith("did you mean 'home'?")
    assert told[1].endswith("axis: 7 is not valid; use an axis of this process: 1")
    assert "order: switch on" in done.stderr  # what comes after a mistake is done


@pytest.mark.parametrize("speed", ["0.1", "20"])
def test_speeds_that_are_allowed_run(capsys, speed):
    assert main(["box", "--channel", f"speed-{os.getpid()}", "--speed", speed, "--duration", "0.3s", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["axes"][0]["state"] == "NOT_HOMED"


def test_orders_without_end_do_not_keep_it_from_ending():
    with subprocess.Popen(["yes", "status"], stdout=subprocess.PIPE) as endless:
        words = ["box", "--channel", f"poured-{os.getpid()}", "--duration", "500ms", "--json"]
        done = subprocess.run(
            [sys.executable, "-m", "rtec", *words], stdin=endless.stdout, capture_output=True, timeout=120, check=True
        )
        endless.kill()
    found = json.loads(done.stdout)
    assert found["ended"] == "duration"
    assert found["run_s"] < 1.0
    assert found["frames_sent"] + found["frames_unsent"] > 50
