"""The fixtures for users' tests, run as a user runs them; the page that explains them is run word by word."""

import csv
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from importlib.metadata import entry_points
from pathlib import Path

import can
import pytest

import rtec.link.simulated
from rtec.errors import ArgumentError
from rtec.link.simulated import SimulatedBus
from rtec.link.simulated_can import SimulatedCan
from rtec.machine.bench_faults import BenchFaults, kind_of
from rtec.machine.faults import FaultKind
from rtec.machine.workbench import bench_of
from rtec.units import PS_PER_S

pytest_plugins = ["pytester"]

PAGE = Path(__file__).parents[2] / "docs" / "how-to-test-your-pc.md"
INSTALLED = any(point.value == "rtec.pytest_plugin" for point in entry_points(group="pytest11"))
PLUGIN = () if INSTALLED else ("-p", "rtec.pytest_plugin")
MENDED = "            total = max(accepted - WINDOW, min(accepted + WINDOW, wanted))\n"


@pytest.fixture(scope="module", autouse=True)
def compiled():
    """Import all before: a run inside this process forgets what it imports, and numba imports some modules late."""
    bench = bench_of()
    with SimulatedCan(bench.bus) as bus:
        BenchFaults(bench, bus.clock.jump).arm("frame lost", at_s=0.0)
        bench.boxes[1].trip()
        bench.boxes[1].switch(False)
        bus.send(can.Message(arbitration_id=0x201, data=bytes(8), is_extended_id=False))
        bus.recv(0.1)
        assert bench.boxes[1].audit


def blocks(name):
    """Return the code that the page shows under a file's name."""
    return re.findall(rf"`{name}`.*?\n\n```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


@pytest.fixture
def user(pytester):
    """A user's folder with the page's program in it."""
    first, rest = blocks("my_pc.py")
    pytester.makepyfile(my_pc=rest + "\n\n" + first)
    return pytester


def correct(pytester):
    path = pytester.path / "my_pc.py"
    text = path.read_text(encoding="utf-8")
    assert text.count("            total = wanted - accepted\n") == 1
    path.write_text(text.replace("            total = wanted - accepted\n", MENDED), encoding="utf-8")


def run(pytester, *arguments):
    return pytester.runpytest_inprocess(*PLUGIN, "-p", "no:cacheprovider", *arguments)


def test_the_page_catches_the_bug(user):
    (test,) = blocks("test_my_pc.py")
    user.makepyfile(test_my_pc=test)
    result = run(user)
    result.assert_outcomes(failed=2)
    said = re.findall(r"\n    (E .*)", PAGE.read_text(encoding="utf-8"))
    assert len(said) == 2
    result.stdout.fnmatch_lines([line.replace("[", "[[]") for line in said])


def test_the_page_passes_once_mended(user):
    assert MENDED in PAGE.read_text(encoding="utf-8")
    (test,) = blocks("test_my_pc.py")
    others = re.findall(
        r"```python\n((?:import pytest\n\n\n)?(?:@pytest|def test_).*?)```", PAGE.read_text(), re.DOTALL
    )
    assert len(others) == 3
    user.makepyfile(test_my_pc="\n\n".join(["import time", test, *others]))
    correct(user)
    path = user.path / "my_pc.py"
    path.write_text("import time\n" + path.read_text())
    run(user).assert_outcomes(passed=7)


def test_a_program_that_forgets_to_hold_is_caught(user):
    """NISTIR 4832: at "I Still Don't Believe You" the PC holds the machine; this program goes on asking."""
    correct(user)
    user.makepyfile(
        """
        import my_pc

        def test_it_stops_asking(rtec_box, rtec_bus, rtec_faults):
            rtec_faults.arm("total_bit_flipped", at_s=0.3, most=3)
            rtec_faults.arm("FRAME_MASQUERADE", at_s=0.5, most=40, must_fire=False)
            rtec_bus.play(my_pc.correct, 1.0, rtec_bus, lambda position_mm: 0.0)
            assert rtec_box.held
            assert rtec_bus.recv(0.1) is not None
            assert sum(rtec_faults.times.values()) >= 3
            asked = rtec_box.view.counters.requests
            rtec_bus.play(my_pc.correct, 0.2, rtec_bus, lambda position_mm: 0.0)
            assert rtec_box.view.counters.requests == asked, "it goes on asking a box that has stopped"
        """
    )
    result = run(user)
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*it goes on asking a box that has stopped*"])


def test_a_fault_without_effect_fails_the_test(user):
    user.makepyfile(
        """
        def test_too_short(rtec_bus, rtec_faults):
            rtec_faults.arm("frame lost", place=0, at_s=0.1)
            rtec_bus.clock.sleep(0.5)  # nobody sends

        def test_on_purpose(rtec_bus, rtec_faults):
            rtec_faults.arm("frame lost", place=0, at_s=0.1, must_fire=False)
            rtec_bus.clock.sleep(0.5)

        def test_with_effect(rtec_bus, rtec_faults):
            rtec_faults.arm("frame lost", place=1, at_s=0.1)
            rtec_bus.clock.sleep(0.5)

        def test_a_failure_of_its_own(rtec_bus, rtec_faults):
            rtec_faults.arm("frame lost", place=0, at_s=0.1)
            assert False, "mine"
        """
    )
    result = run(user)
    result.assert_outcomes(failed=2, passed=2)
    result.stdout.fnmatch_lines(["armed, but without effect: frame lost at 0.1 s, bus 0.*", "*mine*"])
    assert "Traceback" not in result.stdout.str()


def test_each_test_with_faults_is_a_record_as_of_a_campaign(user):
    user.makepyfile(
        """
        import pytest

        @pytest.mark.rtec(design="c", requirement="SR-7")
        def test_power(rtec_box, rtec_bus, rtec_faults, rtec_record):
            rtec_faults.arm("power lost", at_s=0.1, seed=5)
            rtec_bus.clock.sleep(0.3)
            assert rtec_box.held
            rtec_record["phase"] = "start-up"

        def test_nothing_sent(rtec_bus, rtec_faults):
            rtec_faults.arm("frame lost", place=0, at_s=0.1, must_fire=False)
            rtec_bus.clock.sleep(0.2)

        def test_wrong(rtec_bus, rtec_faults):
            rtec_faults.arm("frame lost", place=1, at_s=0.1)
            rtec_faults.arm("box_restarted", at_s=0.15)
            rtec_bus.clock.sleep(0.2)
            assert False

        def test_without_faults(rtec_box): ...
        """
    )
    run(user, "--rtec-csv", "trials.csv", "--junitxml", "trials.xml").assert_outcomes(passed=3, failed=1)
    with (user.path / "trials.csv").open(newline="") as file:
        power, nothing, wrong = csv.DictReader(file)
    assert [row["result"] for row in (power, nothing, wrong)] == ["passed", "not activated", "failed"]
    assert (power["fault"], power["phase"], power["design"], power["requirement"]) == (
        "power lost", "start-up", "c", "SR-7"
    )  # fmt: skip
    assert (power["moment_ps"], power["activated_ps"], power["seed"]) == (str(PS_PER_S // 10),) * 2 + ("5",)
    assert (power["stopped_by"], float(power["detected_s"]) < 0.01) == ("box", True)
    assert power["encoder_counts"] == power["controller_counts"] == "0"
    assert (wrong["second"], wrong["second_fired"]) == ("box restarted", "1")
    assert power["again"].endswith("::test_power") and power["version"].startswith("rtec ")
    suite = ET.parse(user.path / "trials.xml").getroot()[0]  # noqa: S314 - our own
    cases = [{one.get("name"): one.get("value") for one in case.iter("property")} for case in suite.iter("testcase")]
    assert [case.get("fault") for case in cases] == ["power lost", "frame lost", "frame lost", None]
    assert set(cases[0]) == {name for name, value in power.items() if value}


def test_options_come_from_markers_and_parameters(user):
    user.makepyfile(
        """
        import pytest

        pytestmark = pytest.mark.rtec(design="c", axes=2)

        def test_module(rtec_box, rtec_bench):
            assert (rtec_box.step_counts, sorted(rtec_bench.boxes)) == (2, [1, 2])

        @pytest.mark.rtec(design="b", window_steps=5, count_um=0.5)
        def test_nearest_wins(rtec_box, rtec_bench):
            settings = rtec_box.settings
            assert (rtec_box.step_counts, settings.handshake.window_steps, len(rtec_bench.boxes)) == (1, 5, 2)
            assert settings.encoder.count_mm == 0.0005

        @pytest.mark.parametrize("rtec_box", [{"design": "a"}, {"design": "original"}], indirect=True)
        def test_parameters(rtec_box, rtec_bus):
            assert rtec_box.step_counts == 4
            assert rtec_bus.recv(1.0).arbitration_id == 0x181

        @pytest.mark.rtec(designn="a")
        def test_misspelt(rtec_box): ...

        @pytest.mark.rtec(design="d")
        def test_unknown(rtec_bus): ...

        @pytest.mark.rtec("a")
        def test_unnamed(rtec_bus): ...
        """
    )
    result = run(user, "--strict-markers", "-W", "error")
    result.assert_outcomes(passed=4, errors=3)
    result.stdout.fnmatch_lines(
        [
            "the marker rtec has no option 'designn'; did you mean 'design'?",
            "the marker rtec: design: 'd' is not a design; use one of original, a, b, c*",
            "the marker rtec takes options by name, found ('a',)",
        ]
    )
    assert "Traceback" not in result.stdout.str()


def test_pytest_lists_marker_and_fixtures(user):
    run(user, "--markers").stdout.fnmatch_lines(["@pytest.mark.rtec(design='original', count_um=1.0, *"])
    lines = run(user, "--fixtures").stdout
    lines.fnmatch_lines_random(["rtec_box*", "rtec_bus*", "rtec_faults*", "rtec_bench*"])


def test_it_costs_nothing_where_nobody_asks():
    """The plugin loads in every project where rtec is installed: numpy, numba and python-can do not come with it."""
    code = (
        "import sys, rtec.pytest_plugin; "
        "print([name for name in ('numpy', 'numba', 'can', 'rtec.machine') if name in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


# ------------------------------------------------------------------ the bus as python-can's users know it


@pytest.fixture
def bus():
    with SimulatedCan(SimulatedBus()) as bus:
        yield bus


def message(identifier=0x201, data=bytes(8), **options):
    return can.Message(arbitration_id=identifier, data=data, is_extended_id=False, **options)


def test_recv_moves_the_time_to_the_frame_or_by_the_timeout(bus):
    with bus._simulated.transport() as other:
        assert bus.recv(0.25) is None
        assert bus.clock.monotonic() == 0.25
        other.send(rtec.link.simulated.Frame(identifier=0x123, data=b"\x01\x02"))
        received = bus.recv(10.0)
        assert (received.arbitration_id, bytes(received.data), received.dlc) == (0x123, b"\x01\x02", 2)
        assert received.timestamp == bus.clock.monotonic() == pytest.approx(0.25 + 270e-6)


def test_waiting_for_ever_ends_in_an_error(bus):
    with pytest.raises(can.CanOperationError, match="without a timeout would never return"):
        bus.recv()


@pytest.mark.parametrize("wrong", [{"is_remote_frame": True}, {"is_fd": True}, {"is_error_frame": True}])
def test_frames_that_it_does_not_carry(bus, wrong):
    with pytest.raises(can.CanOperationError, match="classic data frames"):
        bus.send(message(data=b"" if "is_remote_frame" in wrong else bytes(8), **wrong))


def test_threads_are_refused(bus):
    with pytest.raises(NotImplementedError, match="send in the program's own loop"):
        bus.send_periodic(message(), 0.01)


def test_after_shutdown(bus):
    bus.shutdown()
    for call in (lambda: bus.send(message()), lambda: bus.recv(0.1)):
        with pytest.raises(can.CanOperationError, match="is closed"):
            call()
    assert bus.state is can.BusState.ERROR


def test_a_program_without_an_end_is_stopped_in_its_time(bus):
    seen = []

    def program(step_s):
        while True:
            try:
                bus.clock.sleep(step_s)
                seen.append(bus.clock.monotonic())
                bus.send(message())
            except Exception:  # noqa: S110 - a program that goes on whatever happens
                pass

    assert bus.play(program, 1.0, 0.3) is None
    assert seen == pytest.approx([0.3, 0.6, 0.9])
    assert bus.clock.monotonic() == 1.0
    assert bus.play(lambda: "done", 0.5) == "done"
    assert bus.clock.monotonic() == 1.5


def test_the_clock_jumps_by_day_only(bus):
    noted = []
    bus.at(1.0, lambda: bus.clock.jump(-5 * PS_PER_S, lambda: noted.append(bus.clock.monotonic())))
    bus.clock.sleep(2.0)
    assert noted == []
    assert (bus.clock.time(), bus.clock.monotonic(), noted) == (-3.0, 2.0, [2.0])
    assert (bus.clock.time_ns(), bus.clock.monotonic_ns()) == (-3 * 10**9, 2 * 10**9)


# ------------------------------------------------------------------ faults by name


def test_every_class_of_faults_has_its_name():
    for kind in FaultKind:
        for name in (kind, kind.name, kind.value, kind.name.lower().replace("_", " "), kind.value.upper()):
            assert kind_of(name) is kind
    with pytest.raises(ArgumentError, match=r"did you mean 'frame.lost'"):
        kind_of("frame losst")


@pytest.mark.parametrize(
    ("kind", "options", "field"),
    [
        ("PC killed", {"at_s": 1.0}, "kind"),
        ("probe trip", {"at_s": 1.0, "place": 3}, "place"),
        ("frame lost", {"at_s": -1.0}, "at_s"),
        ("frame lost", {"at_s": (2.0, 1.0)}, "at_s"),
        ("bus off", {"at_s": 1.0}, "place"),
        ("PC clock jumps back", {"at_s": 1.0}, "delay_ps"),
    ],
)
def test_what_a_fault_cannot_be(kind, options, field):
    with pytest.raises(ArgumentError, match=field):
        BenchFaults(bench_of(), lambda by_ps, note: None).arm(kind, **options)


def test_activation_at_the_axis():
    """Each fault of an axis proves itself by what it does there, and not by its time having come."""
    bench = bench_of(axes=2)
    faults = BenchFaults(bench, lambda by_ps, note: None)
    faults.arm("encoder cable open", at_s=0.1, lasting_s=0.1, place=1)  # nothing moves, but both lines go up
    faults.arm("one line of a pair broken", at_s=0.1, lasting_s=0.1, place=2)  # it keeps the level: no effect at rest
    faults.arm("glitches", at_s=0.3, place=1)  # none without an edge
    faults.arm("box restarted", at_s=0.4, place=2)
    faults.arm("disable switch thrown", at_s=0.4, while_inserting=True)  # no insertion
    bench.bus.run(until_ps=PS_PER_S)
    fired = [times > 0 for times in faults.times.values()]
    assert fired == [True, False, False, True, False]
    assert len(faults.unfired) == 3
