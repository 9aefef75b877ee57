import math

import numpy as np
import pytest
from drive_oracle import reference
from scipy.interpolate import CubicHermiteSpline

from rtec.axis.plants import (
    BallScrew,
    Cascade,
    Feedback,
    Friction,
    LinearMotor,
    ScrewRunout,
    TorqueRipple,
    log_columns,
    run_current,
    run_drive,
)
from rtec.errors import ArgumentError

PERIOD_S = 0.25e-3
DRY = Friction(static_n=20.0, coulomb_n=20.0)
FREE = Friction(static_n=0.0, coulomb_n=0.0)
DRIVES = {
    "motor": LinearMotor(cogging_phase_deg=30.0),
    "mapped motor": LinearMotor(feedforward_map_a=(0.0, 0.15, 0.0, -0.15)),
    "screw with runout": BallScrew(once_a_turn=ScrewRunout(phase_deg=40.0), backlash_um=4.0),
    "screw with ripple": BallScrew(once_a_turn=TorqueRipple(), feedback=Feedback.ROTARY_ENCODER),
}


def times(seconds, period_s=PERIOD_S):
    return np.arange(round(seconds / period_s) + 1) * period_s


def there_and_back(time_s, way_mm, seconds):
    return 0.5 * way_mm * (1.0 - np.cos(2 * np.pi * time_s / seconds))


def constant_speed(speed_mm_s, seconds, ramp_s):
    t = times(seconds)
    return t, np.where(t < ramp_s, 0.5 * speed_mm_s * t**2 / ramp_s, speed_mm_s * (t - 0.5 * ramp_s))


def amplitude(values, position_mm, period_mm):
    """Amplitude of the wave of a period in the values, along the position."""
    turn = 2 * np.pi * position_mm / period_mm
    columns = np.column_stack([np.ones_like(turn), np.sin(turn), np.cos(turn)])
    return math.hypot(*np.linalg.lstsq(columns, values, rcond=None)[0][1:])


@pytest.mark.parametrize("drive", DRIVES.values(), ids=DRIVES)
def test_a_run_keeps_to_an_implicit_solver_within_the_error_that_it_states(drive):
    t = times(0.06)
    command = there_and_back(t, 1.0, 0.05)
    corrector = np.where(t > 0.02, 0.002, 0.0)
    run = run_drive(drive, t, command, corrector=corrector)
    t4 = np.arange(4 * t.size - 3) / 4
    cubic = CubicHermiteSpline(t, command, np.gradient(command, PERIOD_S))(t4 * PERIOD_S)
    speed = np.gradient(command, PERIOD_S)
    fed = [np.interp(t4, np.arange(t.size), a) for a in (speed, np.gradient(speed, PERIOD_S))]
    held = np.append(np.repeat(corrector[:-1], 4), corrector[-1])
    exact = reference(drive, np.stack([cubic, *fed, held]), method="LSODA")[::4]
    error_nm = 1e6 * np.abs(run.load_mm - exact[:, -1]).max()
    assert error_nm < 1.0
    assert error_nm <= run.integration_error_nm + 0.005  # the solver's own
    assert run.integration_error_nm < 1.0
    assert f"{run.integration_error_nm:.2g} nm" in str(run)


def test_a_stiff_and_light_drive_takes_shorter_steps():
    t = times(0.05)
    run = run_drive(BallScrew(carriage_kg=1.0, stiffness_n_um=1000.0), t, there_and_back(t, 1.0, 0.05))
    assert run.integration_error_nm < 1.0


@pytest.mark.parametrize("feedforward", [0.0, 0.984])
@pytest.mark.parametrize("kind", [LinearMotor, BallScrew])
def test_the_following_error_of_a_constant_speed_is_what_feed_forward_leaves(kind, feedforward):
    cascade = Cascade(velocity_feedforward=feedforward)
    quiet = {"cogging_n": 0.0} if kind is LinearMotor else {"once_a_turn": None}
    t, command = constant_speed(200.0, 1.0, 0.2)
    run = run_drive(kind(cascade=cascade, **quiet), t, command)
    assert run.following_mm[-400:] == pytest.approx(200.0 / 50.0 * (1.0 - feedforward), abs=1e-5)


def test_given_velocities_and_accelerations_feed_forward_like_those_of_the_command():
    t = times(0.5)
    w = 2 * np.pi / 0.5
    command = there_and_back(t, 40.0, 0.5)
    given = run_drive(LinearMotor(), t, command, 20 * w * np.sin(w * t), 20 * w**2 * np.cos(w * t))
    derived = run_drive(LinearMotor(), t, command)
    assert np.abs(given.actual_mm - derived.actual_mm)[200:].max() < 0.02
    without = run_drive(LinearMotor(), t, command, np.zeros_like(t), np.zeros_like(t))
    assert np.abs(without.following_mm).max() > 3.0


def test_current_shows_the_cogging_with_its_period_and_a_map_takes_it_away():
    t, command = constant_speed(5.0, 6.0, 0.1)
    motor = LinearMotor()
    moving = t > 1.2  # two periods: 24 mm
    run = run_drive(motor, t, command)
    assert amplitude(run.current_a[moving], run.load_mm[moving], 12.0) == pytest.approx(5.85 / 39.0, rel=0.01)
    assert amplitude(run.current_a[moving], run.load_mm[moving], 8.0) < 0.001
    table = tuple(0.15 * math.sin(2 * math.pi * k / 256) for k in range(256))
    mapped = run_drive(LinearMotor(feedforward_map_a=table), t, command)
    assert np.ptp(mapped.following_mm[moving]) < 0.01 * np.ptp(run.following_mm[moving])


def test_half_an_ampere_sets_the_motor_in_motion():
    t = times(4.0)
    run = run_current(LinearMotor(), t, 0.2 * t)
    yielded = int(np.argmax(run.load_mm > 0.04))  # twice the way after which the last element slips
    assert run.current_a[yielded] == pytest.approx(0.5, rel=0.02)
    assert 0.0 < run.load_mm[int(np.argmax(run.current_a > 0.45))] < 0.02
    assert run.velocity_mm_s[-1] > 10.0


def test_presliding_loops_close_and_the_way_back_is_twice_the_way_out():
    out = np.linspace(0.0, 0.006, 61)
    away = np.concatenate([out, out[-2::-1], -out[1:], -out[-2::-1], out[1:]])
    force = DRY.along_n(away)
    assert force[-1] == pytest.approx(force[60], rel=1e-12)
    assert force[60 + 40] == pytest.approx(force[60] - 2 * force[20], rel=1e-12)  # Masing's rule
    inner = np.concatenate([out, [0.004, 0.005, 0.004, 0.006], [0.008]])
    assert DRY.along_n(inner)[-2:] == pytest.approx(DRY.along_n(np.append(out, 0.008))[-2:], rel=1e-12)
    assert 0.0 < force[60] < DRY.static_n == DRY.along_n([0.0, 0.1])[-1]


def test_friction_at_speed_is_the_map_of_the_motor():
    motor = LinearMotor(cogging_n=0.0)
    for speed in (5.0, 30.0, 500.0):
        t, command = constant_speed(speed, 0.6, 0.05)
        run = run_drive(motor, t, command)
        steady = motor.friction.steady_n(speed)
        assert run.friction_n[-1] == pytest.approx(steady, rel=1e-3)
        assert run.force_n[-1] == pytest.approx(steady, rel=1e-3)
    linear = motor.friction.coulomb_n + 1e-3 * motor.friction.viscous_n_s_m * 2000.0
    assert motor.friction.steady_n(2000.0) / linear == pytest.approx(0.8, abs=0.005)


def test_friction_and_damping_only_take_energy():
    t = times(0.4)
    drive = LinearMotor(cogging_n=0.0)
    run = run_current(drive, t, np.where(t < 0.1, 2.0, 0.0))
    supplied = np.cumsum(run.force_n * np.gradient(run.load_mm))  # N mm
    kinetic = 0.5e-3 * drive.mass_kg * run.velocity_mm_s**2
    lost = supplied - kinetic
    assert np.diff(lost).min() > -1e-4 * supplied.max()
    assert lost[-1] == pytest.approx(np.sum(run.friction_n * np.gradient(run.load_mm)), rel=0.01)
    free = BallScrew(motor_friction=FREE, carriage_friction=FREE, damping_n_s_m=0.0, once_a_turn=None)
    run = run_current(free, t, np.where(t < 0.01, 1.0, 0.0))
    assert np.ptp(run.velocity_mm_s[200:]) > 1e-3  # screw and carriage go on to swing
    assert np.ptp(run.velocity_mm_s[-800:]) == pytest.approx(np.ptp(run.velocity_mm_s[200:-800]), rel=0.02)


def test_a_reversal_leaves_a_spike_and_play_shows_between_encoder_and_carriage():
    t = times(1.0)
    command = there_and_back(t, 20.0, 1.0)
    near = np.abs(t - 0.5) < 0.05
    frictionless = run_drive(LinearMotor(friction=FREE, cogging_n=0.0), t, command)
    spiked = run_drive(LinearMotor(cogging_n=0.0), t, command)
    assert (
        np.abs(np.diff(spiked.following_mm[near], 2)).max()
        > 10 * np.abs(np.diff(frictionless.following_mm[near], 2)).max()
    )
    screw = BallScrew(backlash_um=10.0, stiffness_n_um=1000.0, once_a_turn=None, feedback=Feedback.ROTARY_ENCODER)
    run = run_drive(screw, t, command)
    apart = run.actual_mm - run.load_mm
    assert apart[t == 0.25] - apart[t == 0.75] == pytest.approx(0.010, rel=0.05)


@pytest.mark.parametrize("once_a_turn", [ScrewRunout(amplitude_um=5.0), TorqueRipple(amplitude_nm=0.2)])
@pytest.mark.parametrize("feedback", Feedback)
def test_a_rotary_encoder_does_not_see_runout_but_both_see_a_ripple_of_torque(once_a_turn, feedback):
    t, command = constant_speed(20.0, 4.0, 0.1)
    run = run_drive(BallScrew(once_a_turn=once_a_turn, feedback=feedback, backlash_um=0.0), t, command)
    late = t > 2.0
    seen_um = 1e3 * amplitude(run.following_mm[late], command[late], 10.0)
    if isinstance(once_a_turn, TorqueRipple):
        assert seen_um > 0.2
    else:
        assert (seen_um > 0.2) == (feedback is Feedback.LINEAR_SCALE)


def test_a_drive_at_its_limit_of_current_does_not_overshoot_afterwards():
    t = times(0.6)
    command = np.where(t < 0.2, there_and_back(t, 40.0, 0.4), 40.0)
    run = run_drive(LinearMotor(cogging_n=0.0, cascade=Cascade(limit_a=0.8)), t, command)
    assert np.abs(run.current_a).max() <= 0.8
    assert np.abs(run.following_mm).max() > 1.0
    assert run.load_mm.max() < 40.1
    assert run.load_mm[-1] == pytest.approx(40.0, abs=1e-3)


def test_a_corrector_moves_the_carriage_by_what_it_adds():
    t = times(1.0)
    still = np.zeros_like(t)
    step = np.where(t < 0.3, 0.0, 0.05)
    run = run_drive(LinearMotor(), t, still, corrector=step)
    assert run.load_mm[-1] == pytest.approx(-0.05, abs=2e-4)
    assert run.actual_mm[-1] == pytest.approx(0.0, abs=2e-4)
    same = run_drive(LinearMotor(), t, still, corrector=lambda at_s: np.where(at_s < 0.3, 0.0, 0.05))
    assert np.array_equal(same.load_mm, run.load_mm)


def test_a_log_has_the_names_of_measurement_files():
    t = times(0.01, 1e-3)
    runs = {axis: run_drive(BallScrew(), t, there_and_back(t, 0.1, 0.01)) for axis in "XY"}
    columns = log_columns(runs)
    assert [*columns] == ["time_s"] + [
        f"{what}_{axis}_{unit}"
        for axis in "xy"
        for what, unit in (("target", "mm"), ("actual", "mm"), ("current", "a"))
    ]
    assert np.array_equal(columns["actual_y_mm"], runs["Y"].actual_mm)
    late = run_drive(BallScrew(), t + 1.0, there_and_back(t, 0.1, 0.01))
    for bad, said in (
        ({}, "no run"),
        ({"xy": runs["X"]}, "one letter"),
        ({"x": runs["X"], "y": late}, "other times"),
    ):
        with pytest.raises(ArgumentError, match=said):
            log_columns(bad)


T = times(0.01)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: LinearMotor(mass_kg=0.0), "mass_kg: 0 kg is too small"),
        (lambda: LinearMotor(feedforward_map_a=(0.1, math.nan)), "feedforward_map_a"),
        (lambda: BallScrew(backlash_um=-1.0), "backlash_um"),
        (lambda: BallScrew(feedback="scale"), "feedback"),
        (lambda: BallScrew(once_a_turn=3.0), "once_a_turn"),
        (lambda: Friction(static_n=1.0, coulomb_n=2.0), "coulomb_n"),
        (lambda: Friction(static_n=1.0, coulomb_n=1.0, yield_um=(1.0,)), "yield_um: 1 distances"),
        (lambda: Cascade(limit_a=math.inf), "limit_a"),
        (lambda: LinearMotor(friction=3.0), "friction: 3.0 is not valid; use Friction"),
        (lambda: run_drive(3.0, T, T), "drive: 3.0"),
        (lambda: BallScrew(carriage_kg=0.1, stiffness_n_um=1e4), "a resonance of 5.* Hz; use at most 4.* Hz"),
        (lambda: run_drive(LinearMotor(), T, T[:-1]), "command_mm: 40 numbers"),
        (lambda: run_drive(LinearMotor(), T, np.append(T[:-1], np.nan)), "command_mm"),
        (lambda: run_drive(LinearMotor(), T, T, corrector=T[:3]), "corrector"),
        (lambda: run_drive(LinearMotor(), T, T, corrector=lambda at_s: at_s[:3]), "corrector"),
        (lambda: run_drive(LinearMotor(), T[:1], T[:1]), "time_s: 1 samples"),
        (lambda: run_drive(LinearMotor(), 0.9 * T, T), "multiple of the 62.5 us"),
        (lambda: run_drive(LinearMotor(), -T, T), "multiple of the 62.5 us"),
        (lambda: run_drive(LinearMotor(), np.append(T[:-1], T[-1] + 1e-9 * T.size), T), "time_s"),
        (lambda: run_current(LinearMotor(), T, T[:5]), "current_a"),
    ],
)
def test_bad_input_is_one_clear_error(call, said):
    with pytest.raises(ArgumentError, match=said):
        call()
