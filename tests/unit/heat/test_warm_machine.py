"""The simulated machine: what its thermometers, its nest of displacement sensors and its files say."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest

from rtec.errors import ArgumentError
from rtec.heat import Duty, Growth, Piece, Room, Thermometer, WarmMachine, warm_machine
from rtec.heat.machines import MASSES_KG

PAPER = Duty.paper(spindle_rpm=4000.0)


@pytest.fixture(scope="module")
def run():
    return warm_machine().run(PAPER, seed=1)


def test_a_thermometer_reads_in_steps_late_and_with_its_offset(run):
    node = run.heat.of("front_outer")
    readings = run.thermometers["front_bearing"]
    assert np.array_equal(readings / 0.0625, np.round(readings / 0.0625))
    before = np.interp(run.time_s - 0.75, run.time_s, node)
    off = readings - before
    assert np.ptp(off) <= 0.0625 + 1e-9
    assert abs(off.mean()) < 0.5
    other = warm_machine().run(PAPER, seed=2).thermometers["front_bearing"]
    assert np.array_equal(warm_machine().run(PAPER, seed=1).thermometers["front_bearing"], readings)
    assert not np.array_equal(other, readings)


def test_the_room_has_a_thermometer():
    machine = warm_machine()
    run = machine.run(Duty((Piece(duration_s=36_000.0),)), room=Room(mean_degc=21.0, swing_k=3.0), every_s=60.0)
    off = (
        run.thermometers["room"]
        - machine.room.mean_degc
        - 3.0 * np.cos(2 * np.pi * (run.time_s - 21_600.0) / 86_400.0)
    )
    assert np.ptp(off) < 0.08
    exact = Thermometer(name="t", node="nut", step_k=0.0, conversion_s=0.0)
    assert exact.readings([0.0, 1.0], [20.01, 20.02], offset_k=0.1).tolist() == pytest.approx([20.11, 20.12])


def test_offsets_fill_the_interval_of_the_data_sheet():
    machine, short = warm_machine(), Duty((Piece(duration_s=2.0),))
    offsets = [
        float(values[0]) - machine.room.at(0.0)
        for seed in range(40)
        for values in machine.run(short, seed=seed).thermometers.values()
    ]
    assert max(np.abs(offsets)) <= 0.5 + 0.0625 / 2
    assert min(offsets) < -0.45 and max(offsets) > 0.45 and abs(np.mean(offsets)) < 0.05


def test_a_machine_grows_by_tens_of_micrometres_and_comes_back(run):
    z = run.displacement_um["z"]
    assert 30.0 < -z[9000] < 120.0
    half = np.argmax(-z > -z[8999] / 2)
    assert 120.0 < run.time_s[half] < 1800.0
    assert abs(z[-1]) < 0.2 * abs(z[8999])
    assert 5.0 < abs(run.displacement_um["y1"][9000]) < 60.0


def test_growth_is_no_smooth_function_of_speed():
    """Below some speed the chiller never runs; above, more speed moves the head hardly more."""
    machine = warm_machine()
    speeds = (1000.0, 2000.0, 3000.0, 4000.0, 5000.0)
    runs = [machine.run(Duty.steps((rpm,), resting_h=0.0), every_s=60.0) for rpm in speeds]
    shares = [run.heat.chiller_runs.mean() for run in runs]
    assert shares[0] == 0.0 and shares[-1] > 0.1
    rises = np.diff([run.displacement_um["x1"][-120:].mean() for run in runs])
    assert rises[0] > 2.0 * rises[-1]


def test_the_nest_shows_shift_and_tilt(run):
    """Along the mandrel a straight line through both sensors: the tilt is that of head and column."""
    machine = warm_machine()
    for axis, place in (("x", 0), ("y", 1)):
        apart = machine.far_mm - machine.near_mm
        tilt_urad = (run.displacement_um[f"{axis}1"] - run.displacement_um[f"{axis}2"]) / apart * 1e3
        warmer = {one.node: run.heat.of(one.node) - machine.reference_degc for one in machine.growths}
        wanted = sum(one.tilt_urad_k[place] * warmer[one.node] for one in machine.growths)
        assert np.allclose(tilt_urad, wanted, atol=1e-9)
        assert np.abs(wanted).max() > 1.0


def test_parts_grow_freely_and_bend_towards_their_cold_side():
    """Each part's share by geometry: bars of 11.5 and 10.5 um for each metre and kelvin."""
    moves = {one.node: np.array([*one.shift_um_k, *one.tilt_urad_k]) for one in warm_machine().growths}
    head = moves["head_left"] + moves["head_right"]
    column = moves["column_front"] + moves["column_back"]
    assert np.allclose(head, [10.5 * 0.25, -10.5 * 0.55, 0.0, 0.0, 0.0])
    assert np.allclose(column, [0.0, 0.0, 10.5 * 0.75, 0.0, 0.0])
    shaft = moves["mandrel"] + moves["shaft_nose"] + moves["housing_front"]
    assert np.allclose(shaft, [0.0, 0.0, -11.5 * (0.16 + 0.14 + 0.20), 0.0, 0.0])
    # column, its front a kelvin warmer: it leans back by an angle, so the arm in front lifts, the mandrel swings out
    angle = 10.5 * 0.75 / 0.45
    assert np.allclose(
        (moves["column_front"] - moves["column_back"]) / 2, [0.0, angle * 0.75 / 2, angle * 0.55, 0.0, -angle]
    )
    # head, its left a kelvin warmer: the arm bends to the right; the nose's face goes down on the left
    bent = (moves["head_left"] - moves["head_right"] - [10.5 * 0.25, 0.0, 0.0, 0.0, 0.0]) / 2
    assert np.allclose(bent, [10.5 * 0.55**2 / 2 / 0.5, 0.0, 0.0, 10.5 * 0.20 / 0.5, 0.0])


def test_speed_and_force_move_the_spindle_at_once():
    machine = warm_machine()
    duty = Duty((Piece(duration_s=1.0), Piece(duration_s=1.0, spindle_rpm=6000.0, force_n=300.0)))
    before, after = (
        np.array([machine.run(duty).displacement_um[name][row] for name in ("x1", "y1", "z")]) for row in (0, 1)
    )
    moved = 300.0 * np.array(machine.compliance_um_n) + np.array([0.0, 0.0, machine.axial_um_krpm2 * 36.0])
    assert np.allclose(after - before, moved, atol=0.02)


def test_the_screw_grows_with_the_feed_and_so_does_the_axis():
    machine = warm_machine()
    still, fed = (
        machine.run(Duty((Piece(duration_s=3600.0, feed_mm_s=feed),)), every_s=60.0) for feed in (0.0, 50.0)
    )
    course = fed.course("z")
    assert still.screw_per_mm[-1] * 1e6 < 5.0
    assert 50.0 < fed.screw_per_mm[-1] * 1e6 < 500.0
    screw_k = fed.heat.of("screw")[-1] - machine.reference_degc
    far, near = course.growth_mm(3600.0, 400.0), course.growth_mm(3600.0, 0.0)
    assert far - near == pytest.approx(400.0 * 11.5e-6 * screw_k)
    assert near == pytest.approx(1e-3 * fed.displacement_um["z"][-1] + fed.screw_shift_mm[-1])


def test_a_course_says_what_the_pc_and_the_axis_see(run):
    for axis, channel in (("x", "x1"), ("y", "y1")):
        course = run.course(axis)
        assert course.growth_mm(5000.0, 300.0) == pytest.approx(1e-3 * run.displacement_um[channel][5000])
    assert course.at("motor", 5000.0) == run.thermometers["motor"][5000]
    assert course.spindle_rpm[[8999, 9000]].tolist() == [4000.0, 0.0]
    with pytest.raises(ArgumentError, match="axis: 'a' is not an axis; use one of x, y, z"):
        run.course("a")


def test_a_file_holds_a_row_a_minute_with_noise_from_its_seed(run, tmp_path):
    def read(**options):
        run.write_csv(tmp_path / "run.csv", **options)
        with open(tmp_path / "run.csv", newline="", encoding="utf-8") as file:
            heading, *rows = csv.reader(file)
        return heading, np.array(rows, dtype=np.float64)

    heading, quiet = read()
    assert heading[:9] == [
        "time_s",
        "spindle_rpm",
        "feed_mm_s",
        "force_n",
        "x1_um",
        "x2_um",
        "y1_um",
        "y2_um",
        "z_um",
    ]
    assert heading[9:] == [f"temperature_{name}_degc" for name in run.thermometers]
    assert quiet[:, 0].tolist() == [60.0 * k for k in range(271)]
    assert quiet[:, heading.index("spindle_rpm")].tolist() == [4000.0] * 150 + [0.0] * 121
    assert np.allclose(quiet[:, heading.index("z_um")], run.displacement_um["z"][::60], atol=1e-4)
    _, noisy = read(noise_um=0.5, seed=3)
    noise = (noisy - quiet)[:, 4:9]
    assert 0.45 < noise.std() < 0.55 and not (noisy - quiet)[:, 9:].any()
    assert np.array_equal(read(noise_um=0.5, seed=3)[1], noisy)
    with pytest.raises(ArgumentError, match=r"every_s: 0.5 is not valid; use 1 s"):
        run.write_csv(tmp_path / "run.csv", every_s=0.5)


def test_seeds_give_machines_of_one_kind():
    found = []
    for seed in range(20):
        run = warm_machine(seed).run(Duty.shop(seed=seed), every_s=10.0)
        found.append((np.ptp(run.displacement_um["z"]), run.heat.degc.max()))
    growth_um, hottest = np.array(found).T
    assert (growth_um > 20.0).all() and (growth_um < 200.0).all() and (hottest < 80.0).all()
    assert growth_um.std() > 0.05 * growth_um.mean()
    typical, *drawn = ([node.capacity_j_k for node in warm_machine(seed).network.nodes] for seed in (None, 1, 2))
    factors = np.log(np.array(drawn) / typical)
    assert 0.1 < factors.std() < 0.2 and np.abs(factors).max() <= 0.3 + 1e-9


def test_a_machine_that_is_warm_starts_warm(run):
    warm = {**run.heat.last_degc, "coolant": 24.5}
    assert warm_machine().run(PAPER, start_degc=warm, chiller_runs=True).heat.chiller_runs[0]
    again = warm_machine().run(PAPER, start_degc=run.heat.last_degc, room=Room(mean_degc=21.0))
    assert not again.heat.chiller_runs[0]
    assert again.displacement_um["z"][0] == pytest.approx(
        run.displacement_um["z"][-1] + 0.4 * 16.0, abs=1e-9
    )  # and the speed's own share


def test_duties_are_as_they_say():
    assert (PAPER.duration_s, len(PAPER.pieces)) == (16200.0, 2)
    assert PAPER.at([-1.0, 20_000.0])[:, 0].tolist() == [4000.0, 0.0]
    shop = Duty.shop(seed=5, hours=8.0)
    assert shop.duration_s == 8 * 3600.0 and shop != Duty.shop(seed=6, hours=8.0)
    assert len({piece.spindle_rpm for piece in shop.pieces}) > 5
    steps = Duty.steps((1250.0, 2500.0), running_h=4.0, resting_h=4.0)
    assert steps.at(np.array([0.0, 14399.9, 14400.0, 28800.0]))[:, 0].tolist() == [1250.0, 1250.0, 0.0, 2500.0]
    with pytest.raises(ArgumentError, match="pieces: no piece"):
        Duty(())


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({"thermometers": (Thermometer(name="t", node="screwnut"),)}, "thermometer t: 'screwnut' is not a node"),
        (
            {"thermometers": (Thermometer(name="t", node="nut"),) * 2},
            "thermometer: t is not valid; use each name once",
        ),
        ({"growths": (Growth(node="nit"),)}, "growth: 'nit' is not a node"),
        ({"reference_degc": 1e3}, "reference_degc: 1000 degC is too large"),
    ],
)
def test_a_machine_that_cannot_be_is_refused(parts, said):
    machine = warm_machine()
    with pytest.raises(ArgumentError, match=said):
        WarmMachine(**({"network": machine.network, "growths": (), "thermometers": ()} | parts))
    with pytest.raises(ArgumentError, match=r"^duty: "):
        machine.run("paper")


PAGE = (Path(__file__).parents[3] / "docs" / "warm-machine.md").read_text(encoding="utf-8")


def test_the_examples_of_the_page_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    first, own, *_ = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    exec(own, {})  # noqa: S102 - the page's own lines
    assert capsys.readouterr().out == "[47.1 36.9]\n"
    exec(first, {})  # noqa: S102 - the page's own lines
    z_um, bearing_degc = map(float, capsys.readouterr().out.split())
    assert -120.0 < z_um < -20.0 and 25.0 < bearing_degc < 45.0
    assert len((tmp_path / "spindle.csv").read_text().splitlines()) == 1 + 271


def test_the_parts_of_the_page_are_those_of_the_machine():
    rows = re.findall(r"^\| `(\w+)` \| ([\d.]+) \| (\d+) \|", PAGE, re.MULTILINE)
    assert {name: (float(kg), float(heat)) for name, kg, heat in rows} == MASSES_KG
