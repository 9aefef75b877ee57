"""An axis that turns back between the look and the closing of the latch: no count may be lost, on any image."""

from pathlib import Path

import numpy as np
import pytest

from firmware_model import read_hex
from rtec.board import Microcontroller
from rtec.injector import Design, Stimulus, Totals
from rtec.signal import EdgeStream
from rtec.verify.bench import Bench
from rtec.verify.firmware.algorithm import Firmware

IMAGES = Path(__file__).parents[2] / "firmware_model" / "images"
STEP_COUNTS = {"original": 4, "a": 4, "c": 2}
# folder, ps of a cycle or clock, distance of the slow edges: well below the gate's speed
PARTS = {
    "8051-12mhz": (".", 1_000_000, 150),
    "one-clock-25mhz": ("one_clock_25mhz", 40_000, 400),
    "one-clock-100mhz": ("one_clock_100mhz", 10_000, 700),
}


def motion(tick_ps, every, way, turn, after):
    """Steady edges; behind each one the axis turns back, or goes on, so many ticks later, and comes again."""
    times, moves = [], []
    for k in range(40):
        at = round((k + 20) * (every + 0.37) * tick_ps)
        times.append(at)
        moves.append(way)
        times.append(at + round(after * tick_ps))
        moves.append(turn)
        if turn == -way:
            times.append(at + every * tick_ps // (5 if every == 150 else 2))
            moves.append(way)
    return np.array(times, np.int64), np.cumsum(moves)


@pytest.mark.one_in(2)
@pytest.mark.parametrize("processor", PARTS)
@pytest.mark.parametrize("name", STEP_COUNTS)
def test_a_turn_between_look_and_latch_loses_no_count(name, processor):
    folder, tick_ps, every = PARTS[processor]
    chip = Microcontroller.named(processor)
    box = Firmware(Bench(Design.named(name), chip, read_hex(IMAGES / folder / f"{name}.ihx"), hold_latch=True))
    states = (0, 1, 3, 2)  # level codes, A first, in the order of forward motion
    stimuli = []
    for after in np.arange(0.5, 14.5 if tick_ps < 1_000_000 else 7.5, 0.5):
        for way, turn in ((1, -1), (-1, 1), (1, 1), (-1, -1)):
            for total in (1, -1):
                times, counts = motion(tick_ps, every, way, turn, after)
                levels = [states[int(count) % 4] for count in counts]
                edges = EdgeStream(times, np.array(levels, np.uint8), initial=0)
                asked = Totals([int(times[8]) + 777], [total])
                until_ps = int(times[-1]) + 8 * box.bench.reading_ps
                stimuli.append(Stimulus(edges=edges, requests=asked, until_ps=until_ps))
    for stimulus, response in zip(stimuli, box.play(stimuli), strict=True):
        sent, seen = stimulus.edges.counts(), response.edges.counts()
        assert response.broken is None
        assert seen.net == sent.net + STEP_COUNTS[name] * response.completed.final, str(stimulus.edges.times_ps[:4])
