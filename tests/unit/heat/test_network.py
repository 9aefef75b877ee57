"""The thermal network against closed solutions, against an implicit solver, and against its own energy."""

import math

import numpy as np
import pytest
from heat_oracle import HeatOracle

from rtec.errors import ArgumentError
from rtec.heat import Bearing, Chiller, Duty, Link, Loss, Network, Node, Oil, Piece, Room, warm_machine

AGREED_K = 1e-4
"""Kernel and Radau, over 4.5 h with some 80 switchings of the chiller: 5e-6 K were seen."""


def heated(duration_s, watts=100.0):
    """A duty of one piece in which a `Loss` of 0.1 W for each rev/min gives so much."""
    return Duty((Piece(duration_s=duration_s, spindle_rpm=watts / 0.1),))


HEATER = Loss(name="heater", node="a", per_speed_w=0.1)


def test_one_node_follows_the_exponential():
    network = Network(
        nodes=(Node(name="a", capacity_j_k=2000.0),), links=(Link(a="a", standing_w_k=4.0),), losses=(HEATER,)
    )
    run = network.run(heated(3000.0), room=Room(mean_degc=22.0), every_s=10.0)
    assert np.allclose(run.of("a"), 22.0 + 25.0 * (1.0 - np.exp(-run.time_s / 500.0)), atol=1e-6)


def test_two_nodes_follow_the_eigenvalues_of_their_matrix():
    network = Network(
        nodes=(Node(name="a", capacity_j_k=300.0), Node(name="b", capacity_j_k=1500.0)),
        links=(Link(a="a", b="b", standing_w_k=6.0), Link(a="b", standing_w_k=3.0)),
        losses=(HEATER,),
    )
    run = network.run(heated(2000.0), every_s=20.0)
    matrix = np.array([[-6.0 / 300.0, 6.0 / 300.0], [6.0 / 1500.0, -9.0 / 1500.0]])
    rest = np.array([20.0 + 100.0 / 3.0 + 100.0 / 6.0, 20.0 + 100.0 / 3.0])
    values, vectors = np.linalg.eig(matrix)
    parts = np.linalg.solve(vectors, 20.0 - rest)
    exact = rest + (np.exp(np.outer(run.time_s, values)) * parts) @ vectors.T
    assert np.allclose(run.degc, exact, atol=1e-5)


def test_a_link_of_a_rotating_part_conducts_with_the_power_two_thirds():
    network = Network(
        nodes=(Node(name="a", capacity_j_k=100.0),),
        links=(Link(a="a", standing_w_k=1.0, rotating_w_k=0.5),),
        losses=(Loss(name="heater", node="a", per_speed_w=0.01),),
    )
    rests = [network.run(heated(5000.0, 0.1 * rpm)).of("a")[-1] - 20.0 for rpm in (1000.0, 8000.0)]
    assert np.allclose(rests, [10.0, 80.0 / 2.0], atol=1e-6)


@pytest.mark.parametrize(
    "seed", [None, *(pytest.param(seed, marks=pytest.mark.sweep) for seed in (1, 2, 3, 4, 5, 6, 7, 8))]
)
def test_a_machine_agrees_with_radau(seed):
    machine = warm_machine(seed)
    duty = Duty.paper(spindle_rpm=5000.0, force_n=200.0)
    run = machine.network.run(duty, room=machine.room, every_s=60.0)
    wanted, switched = HeatOracle(machine.network, machine.room).run(duty, run.time_s)
    assert np.abs(run.degc - wanted).max() < AGREED_K
    assert switched > 20


@pytest.mark.parametrize("every_s", [1.0, 7.0, 300.0])
def test_what_is_put_in_is_stored_lost_or_carried_off(every_s):
    machine = warm_machine(seed=4)
    uneven = {"rotor": 40.0, "bed": 18.0}
    run = machine.network.run(Duty.shop(seed=2, hours=4.0), room=machine.room, every_s=every_s, start_degc=uneven)
    assert run.put_in_j[-1] > 1e6 and run.carried_off_j[-1] > 1e5
    left = run.put_in_j - run.to_room_j - run.carried_off_j - run.stored_j
    assert np.abs(left).max() < 1e-9 * run.put_in_j[-1]


def test_rows_do_not_change_what_happens():
    """The duty and the room have corners between the rows of the coarse run, and after its room's last time."""
    machine = warm_machine(seed=4)
    duty, room = Duty.shop(seed=2, hours=2.0), Room(time_s=(0.0, 1000.0, 5000.0), degc=(20.0, 26.0, 19.0))
    fine, coarse = (machine.network.run(duty, room=room, every_s=every_s) for every_s in (1.0, 1800.0))
    assert np.abs(coarse.degc - fine.degc[::1800]).max() < AGREED_K
    wanted, _ = HeatOracle(machine.network, room).run(duty, coarse.time_s)
    assert np.abs(coarse.degc - wanted).max() < AGREED_K


def test_energies_are_the_integrals_of_the_powers():
    machine = warm_machine()
    run = machine.network.run(Duty.paper(spindle_rpm=3000.0), room=machine.room)
    steady = run.time_s <= 9000.0  # the last row at speed is left out: its power is that of the rest
    power = run.heat_w.sum(axis=1)[steady][:-1]
    assert np.trapezoid(power) == pytest.approx(run.put_in_j[steady][-2], rel=1e-6)


@pytest.mark.parametrize(("running", "switched"), [(False, 27.0), (True, 25.0)])
def test_the_chiller_switches_where_its_node_passes_the_thresholds(running, switched):
    """Node of 1000 J/K: warmed by 100 W, cooled by 300 W more; nothing else, so it goes on straight lines."""
    network = Network(
        nodes=(Node(name="a", capacity_j_k=1000.0),),
        links=(),
        losses=(HEATER,),
        chiller=Chiller(node="a", on_degc=27.0, off_degc=25.0, power_w=300.0),
    )
    run = network.run(heated(100.0), every_s=100.0, start_degc={"a": 26.0}, chiller_runs=running)
    assert run.chiller_runs[0] == running
    steps = {False: [(10.0, 27.0), (10.0, 25.0), (20.0, 27.0), (10.0, 25.0), (20.0, 27.0), (10.0, 25.0)],
             True: [(5.0, 25.0), (20.0, 27.0), (10.0, 25.0), (20.0, 27.0), (10.0, 25.0), (20.0, 27.0),
                    (10.0, 25.0)]}[running]  # fmt: skip
    passed = sum(time for time, _ in steps)
    assert steps[0][1] == switched
    assert run.of("a")[-1] == pytest.approx(25.0 + 0.1 * (100.0 - passed), abs=1e-6)
    assert run.carried_off_j[-1] == pytest.approx(300.0 * sum(s for s, to in steps if to == 25.0), rel=1e-9)


@pytest.mark.parametrize(("degc", "running"), [(30.0, False), (20.0, True)])
def test_a_chiller_beyond_its_threshold_switches_at_once(degc, running):
    network = Network(
        nodes=(Node(name="a", capacity_j_k=1000.0),),
        links=(),
        chiller=Chiller(node="a", on_degc=27.0, off_degc=25.0, power_w=100.0),
    )
    run = network.run(Duty((Piece(duration_s=10.0),)), every_s=10.0, start_degc={"a": degc}, chiller_runs=running)
    assert run.chiller_runs.tolist() == [not running] * 2
    assert run.of("a")[-1] == pytest.approx(degc - (1.0 if not running else 0.0))


def test_the_room_is_constant_a_sine_or_given():
    day = Room(mean_degc=20.0, swing_k=3.0, warmest_s=43200.0)
    given_s = np.arange(0.0, 86401.0, 600.0)
    given = Room(time_s=given_s, degc=day.at(given_s))
    network = Network(nodes=(Node(name="a", capacity_j_k=3600.0),), links=(Link(a="a", standing_w_k=1.0),))
    rest = Duty((Piece(duration_s=86400.0),))
    runs = [network.run(rest, room=room, every_s=600.0).of("a") for room in (Room(), day, given)]
    assert np.ptp(runs[0]) == 0.0
    turn = 2.0 * math.pi / 86400.0 * 3600.0
    assert runs[1].max() - 20.0 == pytest.approx(3.0 / math.hypot(1.0, turn), rel=1e-3)
    assert np.abs(runs[2] - runs[1]).max() < 2e-3


def test_a_run_goes_on_where_another_ended():
    machine = warm_machine(seed=3)
    piece = Piece(duration_s=3600.0, spindle_rpm=4000.0, feed_mm_s=30.0)
    room = Room(mean_degc=21.0)
    whole = machine.network.run(Duty((piece, piece)), room=room)
    first = machine.network.run(Duty((piece,)), room=room)
    second = machine.network.run(
        Duty((piece,)), room=room, start_degc=first.last_degc, chiller_runs=bool(first.chiller_runs[-1])
    )
    assert np.allclose(second.degc[-1], whole.degc[-1], atol=1e-6)


def test_oil_that_warms_makes_less_heat_and_preload_makes_more():
    def share(**changed):
        """Heat at the end by heat at the start."""
        bearing = Bearing(name="b", inner="in", outer="out", mean_diameter_mm=70.0, **changed)
        nodes = (Node(name="in", capacity_j_k=400.0), Node(name="out", capacity_j_k=400.0))
        links = (Link(a="in", b="out", standing_w_k=2.0), Link(a="out", standing_w_k=8.0))
        run = Network(nodes=nodes, links=links, bearings=(bearing,)).run(
            Duty((Piece(duration_s=7200.0, spindle_rpm=5000.0),)), every_s=60.0
        )
        return run.heat_w[-1, 0] / run.heat_w[0, 0]

    even = Oil(at_40_mm2_s=20.0, at_100_mm2_s=19.99)
    assert share(oil=even) == pytest.approx(1.0, rel=1e-2)
    assert share() < 0.8
    assert share(oil=even, f1=0.001, preload_n_k=10.0) > 1.05


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({"nodes": (Node(name="a", capacity_j_k=1.0),) * 2, "links": ()}, "node: a is not valid; use each name once"),
        ({"links": (Link(a="a", b="c"),)}, "node: 'c' is not a node"),
        ({"links": (), "losses": (Loss(name="x", node="room"),)}, "node: 'room' is not a node"),
        ({"links": (Link(a="a", standing_w_k=1e6),)}, "node a: capacity_j_k: 1000 J/K is too small for its links"),
        ({"links": (), "chiller": Chiller(node="z", on_degc=2, off_degc=1, power_w=1)}, "node: 'z' is not a node"),
    ],
)
def test_a_network_that_cannot_be_is_refused(parts, said):
    with pytest.raises(ArgumentError, match="^" + said.replace("(", r"\(")):
        Network(**({"nodes": (Node(name="a", capacity_j_k=1000.0),)} | parts))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Node(name="a", capacity_j_k=0.0), "node a: capacity_j_k: 0 J/K is too small"),
        (lambda: Node(name="room", capacity_j_k=1.0), "node: room"),
        (lambda: Link(a="a", b="a"), "link: a - a"),
        (lambda: Link(a="a", b="b", standing_w_k=-1.0), "link a - b: standing_w_k: -1 W/K is too small"),
        (lambda: Chiller(node="a", on_degc=20.0, off_degc=20.0, power_w=1.0), "chiller: off_degc"),
        (lambda: Room(time_s=(0.0, 1.0), degc=(20.0,)), "room: degc"),
        (lambda: Room(time_s=(1.0, 0.0), degc=(20.0, 21.0)), "room: time_s"),
    ],
)
def test_a_part_that_cannot_be_is_refused(make, said):
    with pytest.raises(ArgumentError, match=f"^{said}"):
        make()


def test_more_rows_than_memory_holds_are_refused():
    network = Network(nodes=(Node(name="a", capacity_j_k=1.0),), links=())
    with pytest.raises(ArgumentError, match=r"^every_s: 1 s is too small; use 50 to"):
        network.run(Duty((Piece(duration_s=1e8),)))


def test_temperatures_without_limit_are_refused():
    bearing = Bearing(name="b", inner="a", outer="b", mean_diameter_mm=100.0, f1=0.1, preload_n_k=1000.0)
    network = Network(
        nodes=(Node(name="a", capacity_j_k=100.0), Node(name="b", capacity_j_k=1e6)),
        links=(Link(a="a", b="b", standing_w_k=1.0),),
        bearings=(bearing,),
    )
    duty = Duty((Piece(duration_s=36000.0, spindle_rpm=10_000.0),))
    with pytest.raises(ArgumentError, match=r"^node a rises above 1000 degC; use less heat"):
        network.run(duty, start_degc={"a": 25.0})
    glowing = Network(
        nodes=(Node(name="a", capacity_j_k=10.0),), links=(Link(a="a", standing_w_k=0.02),), losses=(HEATER,)
    )
    with pytest.raises(ArgumentError, match=r"^node a rises above 1000 degC"):
        glowing.run(heated(1000.0))
    with pytest.raises(ArgumentError, match=r"^start_degc: 'c' is not a node"):
        network.run(duty, start_degc={"c": 25.0})
