"""Readers of captures: the three formats against lines laid out by hand, and files that are refused."""

import zipfile

import numpy as np
import pytest

from rtec.errors import ArgumentError, RtecError
from rtec.signal.captures import read_capture

# the same two lines in each format: A up, B up, A down; the last sample 2 us later
TIMES_PS, LEVELS, END_PS = [1_000_000, 3_000_000, 4_000_000], [1, 3, 2], 6_000_000
CSV = "Time[s], Channel 0, b, A\n-0.000002,1,0,0\n-0.000001,1,0,1\n0.000001,0,1,1\n0.000002,0,1,0\n0.000004,0,1,0\n"
VCD = """$timescale 100 ns $end
$scope module top $end $var wire 1 ! A $end $var wire 1 " B $end $var wire 8 # bus $end $upscope $end
$scope module other $end $var wire 1 % A $end $upscope $end
$enddefinitions $end
#20 $dumpvars 0! 0" x% b0 # $end
$comment #99 1! $end #30 b1 ! 1%
#50 1"
#60 0!
#80
1"
"""


def session(path, samples, *, rate="samplerate=1 MHz\n", size=1, parts=1):
    bits = np.asarray(samples, f"<u{size}").tobytes()
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("version", "2")
        probes = f"total probes=10\nprobe1=A\nprobe{10 if size == 2 else 3}=B\n"
        archive.writestr("metadata", f"[device 1]\ncapturefile=logic-1\n{rate}{probes}unitsize={size}\n")
        cut = [round(len(bits) * k / parts) for k in range(parts + 1)]
        # in the order of letters part 10 comes before part 2
        for k in sorted(range(parts), key=str):
            archive.writestr(f"logic-1-{k + 1}" if parts > 1 else "logic-1", bits[cut[k] : cut[k + 1]])
    return path


@pytest.fixture
def files(tmp_path):
    (tmp_path / "s.csv").write_text(CSV)
    (tmp_path / "v.vcd").write_text(VCD)
    session(tmp_path / "k.sr", [2, 3, 3, 7, 6, 6, 4])
    session(tmp_path / "many.sr", [0, 1, 1, 513, 512, 512, 512], size=2, parts=12)
    return tmp_path


@pytest.mark.parametrize(
    ("name", "channels"), [("s.csv", ()), ("v.vcd", ("top.A", "b")), ("k.sr", ()), ("many.sr", ("a", "B"))]
)
def test_each_format_gives_the_same_lines(files, name, channels):
    capture = read_capture(files / name, *channels)
    assert (capture.edges.times_ps.tolist(), capture.edges.levels.tolist(), capture.edges.initial) == (
        TIMES_PS, LEVELS, 0,
    )  # fmt: skip
    assert (capture.end_ps, capture.moves.tolist()) == (END_PS, [1, 1, 1])


def test_a_rate_that_divides_no_microsecond_leaves_no_drift(tmp_path):
    # 24 MHz: three samples are 125 ns; after 3 million of them no rounding is left
    samples = np.zeros(3_000_001, np.uint8)
    samples[1_000_000:], samples[3_000_000:] = 1, 5
    capture = read_capture(session(tmp_path / "x.sr", samples, rate="samplerate=24 MHz\n"))
    assert capture.edges.times_ps.tolist() == [41_666_666_666, 125_000_000_000]


def test_both_lines_at_once_are_said_with_place_and_number(tmp_path):
    file = tmp_path / "x.csv"
    file.write_text("Time [s],A,B\n0,0,0\n0.5,1,1\n0.75,0,0\n1,1,0\n")
    with pytest.raises(RtecError, match=r"A and B change at once 2 times, first 0\.5 s"):
        _ = read_capture(file).moves


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("x.txt", "", "not a capture by its ending"),
        ("x.csv", "time_s,target\n1,2\n", "headings"),
        ("x.csv", "Time [s],A,B\n", "no rows"),
        ("x.csv", "Time [s],A,B\n0,0,0\n1,X,0\n", "line 3: levels 'X'"),
        ("x.csv", "Time [s],A,B\n0,0,0\n1,1\n", "line 3: 2 columns"),
        ("x.csv", "Time [s],A,B\n0,0,0\nnan,1,0\n", "line 3: time 'nan'"),
        ("x.csv", "Time [s],A,B\n0,0,0\n2,1,0\n1,1,1\n", "goes back in row 3"),
        ("x.csv", "Time [s],A,B\n0,0,0\n2,0,0\n", "neither A nor B changes"),
        ("x.csv", "Time [s],A,B\n0,0,0\n4400000,1,0\n", "longer than 50 days"),
        ("x.vcd", "#0 0! 1!", "no end of the definitions"),
        ("x.vcd", VCD.replace("100 ns", "7 ns"), "timescale '7 ns'"),
        ("x.vcd", VCD.replace("#50", "#9223372036854775808").replace(" A $end $ups", " C $end $ups"), "50 days"),
        ("x.vcd", VCD.replace("#60 0!", "#60 x!").replace(" A $end $ups", " C $end $ups"), "line 8: A or B is n"),
        ("x.sr", "no zip", "a sigrok session"),
    ],
)  # fmt: skip
def test_files_that_are_no_captures_are_refused(tmp_path, name, text, said):
    (tmp_path / name).write_text(text)
    with pytest.raises(RtecError) as error:
        read_capture(tmp_path / name)
    assert said in str(error.value)


@pytest.mark.parametrize(
    ("changes", "said"),
    [({"rate": ""}, "no sample rate"), ({"rate": "samplerate=fast\n"}, "sample rate 'fast'")],
)
def test_sessions_without_time_are_refused(tmp_path, changes, said):
    with pytest.raises(RtecError, match=said):
        read_capture(session(tmp_path / "x.sr", [0, 1], **changes))


def test_channels_are_asked_for_by_name(files):
    with pytest.raises(ArgumentError, match=r"--a: 'A' is the name of several channels; use one of: top\.A, other"):
        read_capture(files / "v.vcd")
    with pytest.raises(ArgumentError, match=r"--b: 'Z' is not a channel of the capture; use one of: Channel 0, b, A"):
        read_capture(files / "s.csv", "A", "Z")
    with pytest.raises(ArgumentError, match="other than that of A"):
        read_capture(files / "s.csv", "A", "a")
