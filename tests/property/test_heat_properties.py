"""Networks of any shape: linear ones against the exponential of their matrix, and what no network may do."""

import numpy as np
from hypothesis import given, settings, strategies as st
from scipy.linalg import expm

from rtec.heat import Duty, Link, Loss, Network, Node, Piece, Room

ROOM_DEGC = 20.0


@st.composite
def linear_networks(draw):
    """Up to five nodes, any links between them and to the room, each with a constant source, and how long."""
    size = draw(st.integers(1, 5))
    capacities = draw(st.lists(st.floats(50.0, 1e5), min_size=size, max_size=size))
    duration_s = draw(st.floats(100.0, 20_000.0))
    rises_k = draw(st.lists(st.floats(0.0, 500.0), min_size=size, max_size=size))  # of each alone
    watts = [rise_k * c / duration_s for rise_k, c in zip(rises_k, capacities, strict=True)]
    starts = draw(st.lists(st.floats(0.0, 60.0), min_size=size, max_size=size))
    pairs = [(i, j) for i in range(size) for j in range(i + 1, size + 1)]  # the last one is the room
    conducted = {pair: draw(st.floats(0.1, 50.0)) for pair in pairs if draw(st.booleans())}
    return capacities, watts, starts, conducted, duration_s


def built(capacities, watts, conducted):
    names = [*(f"n{k}" for k in range(len(capacities))), "room"]
    return Network(
        nodes=tuple(Node(name=name, capacity_j_k=c) for name, c in zip(names[:-1], capacities, strict=True)),
        links=tuple(Link(a=names[i], b=names[j], standing_w_k=g) for (i, j), g in conducted.items()),
        losses=tuple(Loss(name=f"s{k}", node=f"n{k}", per_speed_w=w / 1000.0) for k, w in enumerate(watts)),
    )


@settings(max_examples=60, deadline=None)
@given(linear_networks(), st.sampled_from([0.5, 10.0, 1e6]))
def test_a_linear_network_follows_the_exponential_of_its_matrix(given_network, every_s):
    capacities, watts, starts, conducted, duration_s = given_network
    size = len(capacities)
    run = built(capacities, watts, conducted).run(
        Duty((Piece(duration_s=duration_s, spindle_rpm=1000.0),)),
        room=Room(mean_degc=ROOM_DEGC),
        every_s=min(every_s, duration_s),
        start_degc={f"n{k}": degc for k, degc in enumerate(starts)},
    )
    change = np.zeros((size + 1, size + 1))  # the last state is always 1
    for (i, j), g in conducted.items():
        change[i, i] -= g
        change[i, size if j == size else j] += g * (ROOM_DEGC if j == size else 1.0)
        if j < size:
            change[j, j] -= g
            change[j, i] += g
    change[:size, size] += watts
    change[:size] /= np.array(capacities)[:, None]
    exact = (expm(change * duration_s) @ [*starts, 1.0])[:size]
    assert np.allclose(run.degc[-1], exact, rtol=0.0, atol=5e-3)
    left = run.put_in_j - run.to_room_j - run.carried_off_j - run.stored_j
    flowed = np.abs(run.put_in_j).max() + np.abs(run.stored_j).max() + np.abs(run.to_room_j).max()
    assert np.abs(left).max() <= 1e-9 * flowed + 1e-10 * sum(capacities)  # rounding of small rises


@settings(max_examples=30, deadline=None)
@given(linear_networks())
def test_without_sources_nothing_becomes_warmer_than_the_warmest(given_network):
    capacities, _, starts, conducted, duration_s = given_network
    run = built(capacities, [0.0] * len(capacities), conducted).run(
        Duty((Piece(duration_s=duration_s, spindle_rpm=1000.0),)),
        room=Room(mean_degc=ROOM_DEGC),
        every_s=duration_s / 7.0,
        start_degc={f"n{k}": degc for k, degc in enumerate(starts)},
    )
    assert run.degc.max() <= max(*starts, ROOM_DEGC) + 1e-6
    assert run.degc.min() >= min(*starts, ROOM_DEGC) - 1e-6
