"""rtec simulate: what its words reach, what it prints, and what it refuses."""

import pytest

import rtec.machine
from rtec.axis import Encoder, Imperfections
from rtec.controller import IllegalPolicy, Multiplication, ReceiverSettings
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.machine import OpenPath

VERB = "simulate"
BASE = {"--design": "c", "--frequency": "100kHz", "--cycles": "1000", "--corrections": "10"}


def words(**changes):
    options = BASE | {f"--{key.replace('_', '-')}": value for key, value in changes.items()}
    return [word for pair in options.items() for word in pair]


def test_document_has_the_keys_that_scripts_rely_on(answer):
    # 1000 cycles are 4000 counts backward; ten steps add two forward
    result = answer(*words(seed="7", direction="-"))
    assert (result["design"], result["frequency_hz"], result["seed"]) == ("c", 100e3, 7)
    assert (result["edges"], result["encoder_counts"], result["controller_counts"]) == (4000, -4000, -3980)
    assert (result["corrections_requested"], result["corrections_inserted"], result["step_counts"]) == (10, 10, 2)
    assert (result["illegal_transitions"], result["audit"]) == (0, True)
    # 4000 quarters of 2.5 µs, less the half count before the first line
    assert result["simulated_s"] == pytest.approx(0.01, rel=1e-3)
    assert result["min_separation_ps"] == 125_000
    assert {"wall_s", "edges_per_s"} <= result.keys()


@pytest.fixture
def reached(monkeypatch, said):
    """Return the path that words reach."""

    def of(*words):
        paths, run = [], rtec.machine.simulate
        monkeypatch.setattr(rtec.machine, "simulate", lambda path, **more: paths.append(path) or run(path, **more))
        assert said(*words)[0] in (0, 1)
        return paths[0]

    return of


def test_defaults_are_those_of_the_fast_profile(reached):
    assert reached(*words()) == OpenPath(
        injector=InjectorSettings(
            design=Design.C, timing=Timing.of(Design.C, Processor.FAST), real_edges=RealEdges.HOLD
        ),
        frequency_hz=100e3,
        cycles=1000,
        corrections=10,
    )


def test_every_parameter_is_reached(reached):
    argv = words(
        design="A",
        frequency="1.5 kHz",
        cycles="20",
        corrections="3",
        timing="8051",
        direction="-",
        sign="-",
        seed="11",
        poll="3us",
        poll_offset="1us",
        decide="9us",
        step="1.5us",
        recover="4us",
        latency="6us",
        rest="2ms",
        gate_margin="25%",
        real_edges="merge",
        phase_error="-10deg",
        duty_a="-2%",
        duty_b="1.5 %",
        jitter="5ns",
        counts_per_rev="4000",
        eccentricity="2 counts",
        eccentricity_phase="-90deg",
        glitch_probability="0.1%",
        glitch_width="15ns",
        home_state="3",
        filter_samples="5",
        filter_clock="40MHz",
        multiplication="2",
        policy="guess",
        counter_bits="16",
    )
    us = 1_000_000
    assert reached(*argv) == OpenPath(
        injector=InjectorSettings(
            design=Design.A,
            timing=Timing(
                poll_ps=3 * us,
                poll_offset_ps=us,
                decide_ps=9 * us,
                step_ps=3 * us // 2,
                recover_ps=4 * us,
                latency_ps=6 * us,
                rest_ps=2000 * us,
                gate_margin=0.25,
            ),
            real_edges=RealEdges.MERGE,
        ),
        encoder=Encoder(
            counts_per_rev=4000,
            home_state=3,
            seed=11,
            imperfections=Imperfections(
                phase_error_deg=-10.0,
                duty_error_a=-0.02,
                duty_error_b=0.015,
                jitter_ps=5_000,
                eccentricity_counts=2.0,
                eccentricity_deg=-90.0,
                glitch_probability=0.001,
                glitch_ps=15_000,
            ),
        ),
        receiver=ReceiverSettings(
            filter_samples=5,
            clock_hz=40_000_000,
            multiplication=Multiplication.X2,
            policy=IllegalPolicy.GUESS,
            counter_bits=16,
        ),
        frequency_hz=1500.0,
        cycles=20,
        corrections=-3,
        direction=-1,
    )


def test_gate_can_be_switched_off(reached):
    assert reached(*words(), "--no-gate").injector.timing.gate_margin is None


@pytest.mark.parametrize(
    ("changes", "option", "says"),
    [
        ({"design": "orig"}, "--design", "did you mean 'original'?"),
        ({"timing": "8052"}, "--timing", "did you mean '8051'?"),
        ({"direction": "up"}, "--direction", "+ or -"),
        ({"frequency": "500"}, "--frequency", "500kHz"),
        ({"frequency": "-5kHz"}, "--frequency", "0.001"),
        ({"frequency": "1e400Hz"}, "--frequency", "not finite"),
        ({"cycles": "0"}, "--cycles", "1 to "),
        ({"cycles": "2.5"}, "--cycles", "whole number"),
        ({"cycles": "9" * 9000}, "--cycles", "whole number"),
        # a quarter of 250 s: 4.32 million seconds hold 4320 cycles of 1000 s
        ({"frequency": "0.001 Hz", "cycles": "4321"}, "--cycles", "at most 4320, 50 days"),
        ({"corrections": "-1"}, "--corrections", "--sign -"),
        ({"corrections": "1000000"}, "--corrections", "an edge"),
        ({"jitter": "2us"}, "--jitter", "edges must keep their order"),
        ({"phase_error": "120deg"}, "--phase-error", "-89 to 89"),
        ({"duty_b": "60%"}, "--duty-b", "-45 to 45 %"),
        ({"gate_margin": "-5%"}, "--gate-margin", "-5 % is too small; use 0 to 10000 %"),
        ({"eccentricity": "3 count"}, "--eccentricity", "--counts-per-rev"),
        ({"counts_per_rev": "4001"}, "--counts-per-rev", "multiple of four"),
        ({"glitch_probability": "80%"}, "--glitch-probability", "0 to 50 %"),
        ({"home_state": "4"}, "--home-state", "0 to 3"),
        ({"poll": "1us", "poll_offset": "2us"}, "--poll-offset", "--poll"),
        ({"real_edges": "keep"}, "--real-edges", "merge or hold"),
        ({"filter_clock": "1.5Hz"}, "--filter-clock", "whole number of hertz"),
        ({"multiplication": "3"}, "--multiplication", "1, 2, 4"),
        ({"policy": "gues"}, "--policy", "did you mean 'guess'?"),
        ({"counter_bits": "1"}, "--counter-bits", "2 to 62"),
    ],
)
def test_what_is_refused(refused, changes, option, says):
    err = refused(*words(**changes))
    assert err.startswith(f"rtec: {option}:")
    assert says in err
    assert len(err) < 400


def test_gate_margin_and_no_gate_contradict(refused):
    assert "--no-gate" in refused(*words(gate_margin="5%"), "--no-gate")


def test_table_and_verdict(said):
    code, out, _ = said(*words())
    assert code == 0
    assert "4 020" in out  # 4000 counts and ten steps of two
    assert "good: all corrections inserted (+20 counts)" in out


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        # one insertion of the paper's Original lasts 9 µs at worst: 1 / (4 * 9 µs) / 1.15 = 24.1546 kHz
        ({"design": "original", "timing": "8051", "frequency": "30kHz"}, "24.1546 kHz"),
        # a filter of 2 µs cannot see levels that design C changes 125 ns apart
        ({"filter_samples": "100"}, "illegal transition"),
    ],
)
def test_a_verdict_of_fails_names_its_reason(said, changes, says):
    code, out, _ = said(*words(**changes))
    assert (code, "fails: " in out, says in out) == (1, True, True)


FIRMWARE = {"frequency": "5kHz", "cycles": "400", "corrections": "9", "timing": "firmware"}


def test_the_program_of_the_design_runs_and_the_table_says_so(said, answer):
    found = answer(*words(**FIRMWARE))
    assert (found["audit"], found["corrections_inserted"]) == (True, 9)
    assert found["longest_insertion_ps"] is found["real_edges_inside_insertions"] is None  # its looks are its own
    assert "firmware on 8051-12mhz" in said(*words(**FIRMWARE))[1]


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (["--poll", "2us"], "--poll"),
        (["--decide", "4us"], "--decide"),
        (["--gate-margin", "10%"], "--gate-margin"),
        (["--no-gate"], "gate"),
        (["--corrections", "128"], "--corrections: 128 is too large; use -127 to 127"),
    ],
)
def test_what_the_program_decides_is_refused(refused, more, says):
    assert says in refused(*words(**FIRMWARE), *more)
