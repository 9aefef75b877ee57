"""The line between two processes: who comes, who goes, and what nobody reads."""

import contextlib
import os
import select
import signal
import stat
import subprocess
import sys
import termios
import time
from pathlib import Path

import pytest

from rtec.errors import ArgumentError, LinkError
from rtec.link.frame import Frame
from rtec.link.pseudo_terminal import LONGEST_PENDING_BYTES, Line, find_line, well_known
from rtec.link.python_can import open_transport

S = 10**12

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")


@pytest.fixture(autouse=True)
def runtime_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path / "rtec"


@contextlib.contextmanager
def opened(path):
    descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY)
    try:
        yield descriptor
    finally:
        os.close(descriptor)


def heard(descriptor, count, within_s=2.0):
    data = b""
    end_s = time.monotonic() + within_s
    while len(data) < count and select.select([descriptor], [], [], max(0.0, end_s - time.monotonic()))[0]:
        data += os.read(descriptor, 65536)
    return data


def far_is_held(line):
    """Return whether a program has the far end open, as the relay saw it last."""
    return line._ends[1].held


def waited_for(condition, within_s=2.0):
    end_s = time.monotonic() + within_s
    while not condition() and time.monotonic() < end_s:
        time.sleep(0.002)
    return condition()


# ------------------------------------------------------------------------- the line

EVERY_BYTE = bytes(range(256))


def test_every_byte_passes_unchanged_both_ways_and_without_echo():
    with Line() as line, opened(line.near) as near, opened(line.far) as far:
        os.write(near, EVERY_BYTE)
        assert heard(far, 256) == EVERY_BYTE
        os.write(far, EVERY_BYTE[::-1])
        assert heard(near, 256) == EVERY_BYTE[::-1]
        assert heard(far, 1, within_s=0.02) == b""


def test_the_terminals_are_raw():
    with Line() as line, opened(line.far) as far:
        _, output, _, local, *_ = termios.tcgetattr(far)
        assert not local & (termios.ECHO | termios.ICANON | termios.ISIG)
        assert not output & termios.OPOST


def test_what_is_sent_to_nobody_is_dropped():
    with Line() as line, opened(line.near) as near:
        for _ in range(50):
            os.write(near, b"old" * 300)
        assert waited_for(lambda: line.dropped_bytes == 50 * 900)
        with opened(line.far) as far:
            assert waited_for(lambda: far_is_held(line))
            os.write(near, b"new")
            assert heard(far, 3) == b"new"


@pytest.mark.parametrize("unread", [1, 100, 10_000])
def test_who_comes_next_does_not_get_what_the_last_one_left_unread(unread):
    with Line() as line, opened(line.near) as near:
        with opened(line.far):
            assert waited_for(lambda: far_is_held(line))
            for _ in range(unread):
                os.write(near, b"old")
            time.sleep(0.02)  # it lies in the terminal by now
        assert waited_for(lambda: not far_is_held(line))
        for turn in range(3):
            with opened(line.far) as far:
                assert waited_for(lambda: far_is_held(line))
                os.write(near, b"new%d" % turn)
                assert heard(far, 4) == b"new%d" % turn
                os.write(far, b"back")
                assert heard(near, 4) == b"back"
            assert waited_for(lambda: not far_is_held(line))


def test_nothing_is_passed_on_before_the_channel_is_opened():
    """python-can opens the terminal, waits two seconds by default, and only then the channel."""
    with Line(opened_by=(b"O\r",)) as line, opened(line.near) as near:
        for _ in range(2):
            with opened(line.far) as far:
                assert waited_for(lambda: far_is_held(line))
                os.write(near, b"old" * 300)
                os.write(far, b"S6\rO")
                assert heard(far, 1, within_s=0.05) == b""
                os.write(far, b"\r")
                assert heard(near, 5) == b"S6\rO\r"
                os.write(near, b"new")
                assert heard(far, 3) == b"new"
            assert waited_for(lambda: not far_is_held(line))


def test_a_reader_that_has_stopped_costs_bounded_memory_and_nobody_waits():
    with Line() as line, opened(line.near) as near, opened(line.far) as far:
        assert waited_for(lambda: far_is_held(line))
        begun_s = time.monotonic()
        for _ in range(200):
            os.write(near, b"x" * 1000)
        assert time.monotonic() - begun_s < 2
        assert waited_for(lambda: line.dropped_bytes > 100_000)
        assert line._ends[1].pending_bytes <= LONGEST_PENDING_BYTES
        # room is made, and the line goes on
        heard(far, 1 << 20, within_s=0.1)
        os.write(near, b"end")
        assert heard(far, 3).endswith(b"end")


@pytest.mark.parametrize("holds", ["nobody", "near", "both"])
def test_the_relay_rests_when_nothing_is_said(holds):
    with contextlib.ExitStack() as stack:
        line = stack.enter_context(Line())
        if holds != "nobody":
            stack.enter_context(opened(line.near))
        if holds == "both":
            stack.enter_context(opened(line.far))
        time.sleep(0.03)
        begun_s = time.process_time()
        time.sleep(0.3)
        assert time.process_time() - begun_s < 0.1  # a thread that spins takes 0.3 s


def test_closing_twice_and_without_a_reader():
    line = Line()
    line.close()
    line.close()
    assert not os.path.exists(line.far)


def test_no_descriptor_is_left_open():
    def count():
        return len(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else 0

    before = count()
    for _ in range(3):
        with Line(name="z"):
            pass
        with pytest.raises(LinkError), Line(name="z"), Line(name="z"):
            pass
    assert count() == before


def test_windows_is_told_what_else_there_is(monkeypatch):
    monkeypatch.setattr(sys, "platform", "win32")
    for call in (Line, lambda: find_line("box")):
        with pytest.raises(
            LinkError, match=r"this system has none; use udp_multicast, or slcan with socket://host:port"
        ):
            call()


# ---------------------------------------------------------------- the well-known name


def test_the_far_end_has_a_name_in_a_private_folder(runtime_folder):
    with Line(name="box") as line:
        link = well_known("box")
        assert link == runtime_folder / "box"
        assert os.readlink(link) == line.far == find_line("box")
        assert stat.S_IMODE(runtime_folder.stat().st_mode) == 0o700
    assert list(runtime_folder.iterdir()) == []
    with pytest.raises(LinkError, match="nobody offers this line"):
        find_line("box")


def test_without_a_runtime_folder_it_is_one_by_user_number(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "missing"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    assert well_known("box") == tmp_path / f"rtec-{os.getuid()}" / "box"


def test_a_name_in_use_is_refused_and_left_alone():
    with Line(name="box") as line:
        with pytest.raises(LinkError, match=rf"in use by process {os.getpid()}; choose another name"):
            Line(name="box")
        assert find_line("box") == line.far


def test_a_stale_name_is_replaced_and_not_followed():
    link = well_known("box")
    link.symlink_to("/dev/null")
    with pytest.raises(LinkError, match="nobody offers this line"):
        find_line("box")
    with Line(name="box") as line:
        assert find_line("box") == line.far


def test_a_file_in_the_place_of_the_name_is_kept():
    well_known("box").write_text("mine")
    with pytest.raises(LinkError, match="is no link of ours"):
        Line(name="box")
    assert well_known("box").read_text() == "mine"


@pytest.mark.parametrize("kind", ["open to others", "a link"])
def test_a_folder_that_is_not_ours_alone_is_refused(runtime_folder, tmp_path, kind):
    if kind == "a link":
        (tmp_path / "elsewhere").mkdir(mode=0o700)
        runtime_folder.symlink_to(tmp_path / "elsewhere")
    else:
        runtime_folder.mkdir()
        runtime_folder.chmod(0o777)
    with pytest.raises(LinkError, match="belongs to, or is open to, somebody else"):
        Line(name="box")


@pytest.mark.skipif(os.name != "posix" or os.getuid() != 0, reason="only root can give a folder away")
def test_a_folder_of_another_user_is_refused(runtime_folder):
    runtime_folder.mkdir(mode=0o700)
    os.chown(runtime_folder, 12345, 12345)
    with pytest.raises(LinkError, match="belongs to, or is open to, somebody else"):
        Line(name="box")


@pytest.mark.parametrize("name", ["", ".", "..", "a/b", ".hidden", "x" * 65, "a b", "a\n"])
def test_a_name_is_a_plain_file_name(name):
    with pytest.raises(ArgumentError, match="name"):
        well_known(name)


# ---------------------------------------------------------------- two processes

ECHO = """
import sys
from rtec.link.python_can import open_transport
with open_transport(interface=sys.argv[1], channel=sys.argv[2]) as transport:
    while (received := transport.receive(transport.now_ps() + 20 * 10**12)) is not None:
        transport.send(received.frame)
"""

HOLDER = """
from rtec.link.pseudo_terminal import Line
with Line(name="box") as line:
    print(line.far, flush=True)
    input()
"""


@contextlib.contextmanager
def process(text, *arguments):
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[3])}
    child = subprocess.Popen(
        [sys.executable, "-c", text, *arguments],
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        yield child
    finally:
        child.kill()
        child.communicate()


def answered(transport, number):
    """Say one thing until it comes back."""
    frame = Frame.of_payload(0x123, number)
    for _ in range(200):
        transport.send(frame)
        end_ps = transport.now_ps() + S // 20
        while (received := transport.receive(end_ps)) is not None:
            if received.frame == frame:
                return True
    return False


@pytest.mark.parametrize("interface", ["slcan", "serial"])
def test_programs_at_the_far_end_come_and_are_killed(interface):
    with Line() as line, open_transport(interface=interface, channel=line.near) as box:
        for number in range(2):
            with process(ECHO, interface, line.far) as child:
                assert answered(box, number)
                child.send_signal(signal.SIGKILL)
                child.wait()
            assert waited_for(lambda: not far_is_held(line))
            while box.receive(0) is not None:
                pass
            box.send(Frame.of_payload(0x123, 99))  # to nobody, and no error


def test_a_box_that_is_killed_is_seen_at_the_far_end_and_its_name_taken_over():
    with process(HOLDER) as holder:
        device = holder.stdout.readline().strip()
        assert find_line("box") == device
        with open_transport(interface="slcan", channel=str(well_known("box"))) as pc:
            holder.send_signal(signal.SIGKILL)
            holder.wait()
            with pytest.raises(LinkError, match="has vanished"):
                pc.receive(pc.now_ps() + 20 * S)
        assert well_known("box").is_symlink()
        with pytest.raises(LinkError, match="nobody offers this line"):
            find_line("box")
        with Line(name="box") as line:
            assert find_line("box") == line.far
