"""rtec simulate: what its words reach, what it prints, and what it refuses."""

import json

import pytest
from signal_oracle import read_vcd

import rtec.machine
from rtec.axis import Encoder, Imperfections
from rtec.cli import main
from rtec.controller import IllegalPolicy, Multiplication, ReceiverSettings
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.machine import OpenPath

BASE = {"--design": "c", "--frequency": "100kHz", "--cycles": "1000", "--corrections": "10"}


def words(**changes):
    options = BASE | {f"--{key.replace('_', '-')}": value for key, value in changes.items()}
    return ["simulate", *(word for pair in options.items() for word in pair)]


def refuse_constant(name):
    raise AssertionError(f"{name} is no JSON")


def answer(capsys, argv):
    code = main([*argv, "--json"])
    out, err = capsys.readouterr()
    assert out.count("\n") == 1
    assert err == ""
    return code, json.loads(out, parse_constant=refuse_constant)


@pytest.mark.parametrize(("design", "step"), [("original", 4), ("a", 4), ("b", 1), ("c", 2)])
@pytest.mark.parametrize("direction", ["+", "-"])
@pytest.mark.parametrize("sign", ["+", "-"])
def test_counts_of_directions_and_signs(capsys, design, step, direction, sign):
    # 1000 cycles are 4000 counts in the direction of the motion; ten steps add their counts in that of their sign
    code, result = answer(capsys, words(design=design, direction=direction, sign=sign))
    moved = 4000 if direction == "+" else -4000
    steps = 10 if sign == "+" else -10
    assert code == 0
    assert result["edges"] == 4000
    assert result["encoder_counts"] == moved
    assert result["controller_counts"] == moved + steps * step
    assert result["corrections_requested"] == result["corrections_inserted"] == steps
    assert result["step_counts"] == step
    assert result["illegal_transitions"] == 0
    assert result["audit"] is True


@pytest.mark.parametrize(("multiplication", "width"), [("1", 4), ("2", 2)])
@pytest.mark.parametrize("home", ["0", "1", "2", "3"])
@pytest.mark.parametrize("direction", ["+", "-"])
def test_audit_knows_what_single_and_double_decoders_count(capsys, multiplication, width, home, direction):
    # whole cycles and one to four single counts of Design B: what is less than a count of the decoder stays hidden
    for corrections in range(1, 5):
        changes = {"home_state": home, "corrections": str(corrections), "direction": direction}
        code, result = answer(capsys, words(design="b", multiplication=multiplication, **changes))
        net = (4000 if direction == "+" else -4000) + corrections
        assert (code, result["audit"]) == (0, True)
        assert abs(result["controller_counts"] * width - net) < width


def test_audit_of_a_single_decoder_sees_lost_counts(capsys):
    # the Original merges with the next edge: four counts lost with each insertion, and no illegal transition
    changes = {
        "timing": "8051",
        "frequency": "30kHz",
        "poll_offset": "1us",
        "multiplication": "1",
        "real_edges": "merge",
    }
    code, result = answer(capsys, [*words(design="original", **changes), "--no-gate"])
    assert (code, result["audit"], result["illegal_transitions"]) == (1, False, 0)


def test_document_has_the_keys_that_scripts_rely_on(capsys):
    _, result = answer(capsys, words(seed="7"))
    assert result["design"] == "c"
    assert result["frequency_hz"] == 100e3
    assert result["seed"] == 7
    # 4000 quarters of 2.5 µs, less the half count before the first line
    assert result["simulated_s"] == pytest.approx(0.01, rel=1e-3)
    assert result["min_separation_ps"] == 125_000
    assert {"wall_s", "edges_per_s"} <= result.keys()


def test_nothing_but_the_seed_decides(capsys):
    def counted(seed):
        _, result = answer(capsys, words(jitter="500ns", glitch_probability="5%", filter_samples="0", seed=seed))
        return {key: value for key, value in result.items() if key not in ("wall_s", "edges_per_s", "seed")}

    assert counted("1") == counted("1")
    assert counted("1") != counted("2")


def reached(monkeypatch, argv):
    paths = []
    run = rtec.machine.simulate

    def recording(path, **options):
        paths.append(path)
        return run(path, **options)

    monkeypatch.setattr(rtec.machine, "simulate", recording)
    assert main([*argv, "--json"]) in (0, 1)
    return paths[0]


def test_defaults_are_those_of_the_fast_profile(monkeypatch):
    assert reached(monkeypatch, words()) == OpenPath(
        injector=InjectorSettings(
            design=Design.C, timing=Timing.of(Design.C, Processor.FAST), real_edges=RealEdges.HOLD
        ),
        frequency_hz=100e3,
        cycles=1000,
        corrections=10,
    )


def test_every_parameter_is_reached(monkeypatch):
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
    assert reached(monkeypatch, argv) == OpenPath(
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


def test_gate_can_be_switched_off(monkeypatch):
    assert reached(monkeypatch, [*words(), "--no-gate"]).injector.timing.gate_margin is None


@pytest.mark.parametrize(
    ("changes", "option", "says"),
    [
        ({"design": "d"}, "--design", "original, a, b, c"),
        ({"design": "orig"}, "--design", "did you mean 'original'?"),
        ({"timing": "8052"}, "--timing", "did you mean '8051'?"),
        ({"direction": "up"}, "--direction", "+ or -"),
        ({"sign": "1"}, "--sign", "+ or -"),
        ({"frequency": "500"}, "--frequency", "500kHz"),
        ({"frequency": "-5kHz"}, "--frequency", "0.001"),
        ({"frequency": "0Hz"}, "--frequency", "0.001"),
        ({"frequency": "1e400Hz"}, "--frequency", "not finite"),
        ({"frequency": "nan Hz"}, "--frequency", "500kHz"),
        ({"frequency": "3 mm"}, "--frequency", "500kHz"),
        ({"cycles": "0"}, "--cycles", "1 to "),
        ({"cycles": "-4"}, "--cycles", "1 to "),
        ({"cycles": "2.5"}, "--cycles", "whole number"),
        ({"cycles": "1e30"}, "--cycles", "too large"),
        ({"cycles": "9" * 30}, "--cycles", "too large"),
        ({"cycles": "9" * 9000}, "--cycles", "whole number"),
        # a quarter of 250 s: 4.32 million seconds hold 4320 cycles of 1000 s
        ({"frequency": "0.001 Hz", "cycles": "4321"}, "--cycles", "at most 4320, 50 days"),
        ({"corrections": "-1"}, "--corrections", "--sign -"),
        ({"corrections": "1000000"}, "--corrections", "an edge"),
        ({"corrections": "many"}, "--corrections", "whole number"),
        ({"jitter": "5"}, "--jitter", "5ns"),
        ({"jitter": "2us"}, "--jitter", "edges must keep their order"),
        ({"jitter": "-5ns"}, "--jitter", "0 ps to 1 ms"),
        ({"phase_error": "120deg"}, "--phase-error", "-89 to 89"),
        ({"phase_error": "10"}, "--phase-error", "10deg"),
        ({"duty_a": "0.02"}, "--duty-a", "2%"),
        ({"duty_b": "60%"}, "--duty-b", "-45 to 45 %"),
        ({"gate_margin": "-5%"}, "--gate-margin", "-5 % is too small; use 0 to 10000 %"),
        ({"eccentricity": "3 count"}, "--eccentricity", "--counts-per-rev"),
        ({"eccentricity": "3"}, "--eccentricity", "count"),
        ({"counts_per_rev": "4001"}, "--counts-per-rev", "multiple of four"),
        ({"glitch_probability": "80%"}, "--glitch-probability", "0 to 50 %"),
        ({"glitch_width": "0ns"}, "--glitch-width", "1 ps to 1 s"),
        ({"home_state": "4"}, "--home-state", "0 to 3"),
        ({"seed": "-1"}, "--seed", "use 0 to"),
        ({"seed": "x"}, "--seed", "whole number"),
        ({"poll": "1us", "poll_offset": "2us"}, "--poll-offset", "--poll"),
        ({"step": "0ns"}, "--step", "1 ps to 1 s"),
        ({"rest": "2 hours"}, "--rest", "1 ps to 1 s"),
        ({"gate_margin": "0.15"}, "--gate-margin", "%"),
        ({"gate_margin": "-5%"}, "--gate-margin", "too small"),
        ({"real_edges": "keep"}, "--real-edges", "merge or hold"),
        ({"filter_samples": "-1"}, "--filter-samples", "too small"),
        ({"filter_clock": "1.5Hz"}, "--filter-clock", "whole number of hertz"),
        ({"filter_clock": "1Hz"}, "--filter-clock", "1 kHz"),
        ({"multiplication": "3"}, "--multiplication", "1, 2, 4"),
        ({"policy": "gues"}, "--policy", "did you mean 'guess'?"),
        ({"counter_bits": "1"}, "--counter-bits", "2 to 62"),
        ({"vcd": "/nowhere/x.vcd"}, "--vcd", "no folder /nowhere"),
        ({"vcd": "/"}, "--vcd", "/ is a folder"),
    ],
)
def test_what_is_refused(capsys, changes, option, says):
    assert main(words(**changes)) == 2
    out, err = capsys.readouterr()
    lines = err.splitlines()
    assert out == ""
    assert len(lines) == 1
    assert lines[0].startswith(f"rtec: {option}:")
    assert says in lines[0]
    assert len(lines[0]) < 400


def test_gate_margin_and_no_gate_contradict(capsys):
    assert main([*words(gate_margin="5%"), "--no-gate"]) == 2
    assert "--no-gate" in capsys.readouterr().err


def test_table_and_verdict(capsys):
    assert main(words()) == 0
    out = capsys.readouterr().out
    assert "4 020" in out  # 4000 counts and ten steps of two
    assert "good: all corrections inserted (+20 counts)" in out


def test_verdict_names_the_gate_limit(capsys):
    # one insertion of the paper's Original lasts 9 µs at worst: 1 / (4 * 9 µs) / 1.15 = 24.1546 kHz
    assert main(words(design="original", timing="8051", frequency="30kHz")) == 1
    out = capsys.readouterr().out
    assert "fails: " in out
    assert "24.1546 kHz" in out


def test_verdict_names_lost_counts(capsys):
    # a filter of 2 µs cannot see levels that design C changes 125 ns apart
    assert main(words(filter_samples="100")) == 1
    out = capsys.readouterr().out
    assert "illegal transition" in out


def test_file_is_not_overwritten_unasked(capsys, tmp_path):
    file = tmp_path / "wave.vcd"
    file.write_text("mine")
    assert main(words(vcd=str(file))) == 2
    assert "--force" in capsys.readouterr().err
    assert file.read_text() == "mine"
    assert main([*words(vcd=str(file)), "--force"]) == 0
    assert file.read_text().startswith("$version")
    assert [path.name for path in tmp_path.iterdir()] == ["wave.vcd"]


def test_file_holds_every_edge_of_both_sides(tmp_path):
    file = tmp_path / "wave.vcd"
    assert main(words(vcd=str(file))) == 0
    waves = read_vcd(file.read_bytes())
    changes = {name: len(changes) for name, changes in waves.changes.items()}
    # 4000 edges at the encoder; at the controller two more for each of the ten steps
    assert changes["encoder.enc_A"] + changes["encoder.enc_B"] == 4000
    assert changes["controller.ctl_A"] + changes["controller.ctl_B"] == 4020
    assert waves.also == {f"{side}.{line}": f"{side}.{side[:3].replace('con', 'ctl')}_{line}"
                          for side in ("encoder", "controller") for line in "AB"}  # fmt: skip


def test_an_hour_fits_the_longest_motion(monkeypatch, capsys):
    # an hour at 500 kHz is 1.8e9 cycles; the run itself is too long for a test
    class ReachedError(Exception):
        pass

    def refusing(path, **_):
        raise ReachedError(path.cycles)

    monkeypatch.setattr(rtec.machine, "simulate", refusing)
    assert main(words(frequency="500kHz", cycles="1800000000")) == 70
    assert "ReachedError: 1800000000" in capsys.readouterr().err
