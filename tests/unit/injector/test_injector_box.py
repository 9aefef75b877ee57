"""The box apart from its tables: gate, rest, atomic insertions, loss of power, holding real edges back."""

import pytest

from rtec.errors import ArgumentError
from rtec.injector import Design, Injector, InjectorSettings, Processor, Timing
from rtec.signal import EdgeStream

US = 1_000_000
CODE = {"00": 0, "10": 1, "11": 3, "01": 2}


def box_of(design, *, initial="00", timing=None, **choices):
    timing = timing or Timing.of(design, Processor.MCS51)
    return Injector(InjectorSettings(design=design, timing=timing, **choices), initial=CODE[initial])


def quiet(box, until_us, levels="00"):
    return box.process(EdgeStream([], [], initial=CODE[levels]), until_ps=round(until_us * US))


def test_the_face_refuses_what_it_cannot_take():
    box = box_of(Design.C)
    quiet(box, 10)
    with pytest.raises(ArgumentError, match="time never runs back"):
        box.request(1, at_ps=9 * US)
    with pytest.raises(ArgumentError, match="where the last stream ended"):
        box.process(EdgeStream([], [], initial=1), until_ps=20 * US)
    with pytest.raises(ArgumentError, match="times from 10000000 ps to before 20000000 ps"):
        box.process(EdgeStream([20 * US], [1], initial=0), until_ps=20 * US)
    with pytest.raises(ArgumentError, match="until_ps: '5' is not valid"):
        box.process(EdgeStream([], [], initial=0), until_ps="5")
    with pytest.raises(ArgumentError, match="total"):
        box.request(2**40, at_ps=10 * US)
    with pytest.raises(ArgumentError, match="initial"):
        Injector(box.settings, initial=4)


def test_a_huge_request_takes_no_room_before_its_time():
    box = box_of(Design.C)
    box.request(2**31, at_ps=0)
    assert 20 < len(quiet(box, 100)) < 40
