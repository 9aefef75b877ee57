"""The signals of a box, against a decoder written out by hand."""

from itertools import pairwise

import numpy as np
import pytest
from signal_oracle import FORWARD, read_vcd

from rtec.injector import Totals
from rtec.injector.waves import rows_of_streams, write_waves
from rtec.signal import EdgeStream

STATE = {levels: number for number, levels in enumerate(FORWARD, start=1)}


def text(level):
    return f"{level & 1}{level >> 1}"


def by_hand(levels):
    """States, counts, and whether the last change was illegal, after each level but the first."""
    count, found = 0, []
    for before, after in pairwise(levels):
        turn = (STATE[text(after)] - STATE[text(before)]) % 4
        count += {1: 1, 3: -1, 2: 0}[turn]
        found.append((STATE[text(after)], count, int(turn == 2)))
    return found


def wandering(edges, seed):
    rng = np.random.default_rng(seed)
    states = np.cumsum(rng.choice([1, -1, 2], edges, p=[0.5, 0.35, 0.15])) % 4
    return EdgeStream.from_states(np.cumsum(rng.integers(1, 9, edges)) * 1_000, states, 0)


def value_at(waves, name, t):
    return next((v for at, v in reversed(waves.changes[name]) if at <= t), waves.initial[name])


def signed(value, width):
    return value - (1 << width) if value >> width - 1 else value


@pytest.mark.parametrize("seed", [1, 2])
def test_states_counts_and_illegal_transitions_are_those_of_a_decoder(tmp_path, seed):
    encoder, controller = wandering(200, seed), wandering(150, seed + 10)
    requested, completed = Totals([2_500, 90_500], [-3, 7]), Totals([80_500, 100_500], [-2, 5])
    file = tmp_path / "f.vcd"
    rows = rows_of_streams(encoder, controller, requested, completed, inserted=[(4_000, 9_000)])
    write_waves(file, rows, initial=(0, 0), end_ps=10**7)
    waves = read_vcd(file.read_bytes())
    assert waves.timescale == "100 ps"
    for side, short, stream in (("encoder", "enc", encoder), ("controller", "ctl", controller)):
        width = waves.widths[f"{side}.{short}_count"]
        expected = by_hand([0, *stream.levels.tolist()])
        for t_ps, level, (state, count, wrong) in zip(
            stream.times_ps.tolist(), stream.levels.tolist(), expected, strict=True
        ):
            seen = [value_at(waves, f"{side}.{short}_{name}", t_ps // 100) for name in ("A", "B", "state", "count")]
            assert [*seen[:3], signed(seen[3], width)] == [level & 1, level >> 1, state, count]
            if side == "controller":
                assert value_at(waves, "box.illegal", t_ps // 100) == wrong
    steps = waves.widths["box.requested"]
    assert [(t, signed(v, steps)) for t, v in waves.changes["box.requested"]] == [(25, -3), (905, 7)]
    assert [(t, signed(v, steps)) for t, v in waves.changes["box.completed"]] == [(805, -2), (1005, 5)]
    assert waves.changes["box.inserting"] == [(40, 1), (90, 0)]


def test_an_insertion_of_one_change_shows_from_what_came_before_it():
    encoder = EdgeStream([10_000_000], [1], initial=0)
    controller = EdgeStream([11_000_000, 12_000_000], [1, 3], initial=0)
    for asked_ps, begun_ps in ((9_000_000, 10_000_000), (10_500_000, 10_500_000)):
        rows = rows_of_streams(encoder, controller, Totals([asked_ps], [1]), Totals([12_000_000], [1]))
        assert rows[rows[:, 5] == 1, 0].tolist()[0] == begun_ps
        assert rows[-1].tolist() == [12_000_000, 1, 3, 1, 1, 0]
