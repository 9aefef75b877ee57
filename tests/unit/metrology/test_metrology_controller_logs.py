"""Logs as controllers write them: files made here in each format, and the log in ``../shared/data``."""

import gzip
import json
from pathlib import Path

import numpy as np
import pytest

from rtec.errors import FileFormatError
from rtec.io import read_any_text
from rtec.metrology import column_choices, read_measurement

SHARED = Path(__file__).parents[4] / "shared/data/logs/sinumerik_edge_example.json.gz"
COUNT = 40
T = np.arange(COUNT)
PLACE = {"x": 5.0 * np.sin(T / 9.0), "y": 3.0 * np.cos(T / 9.0)}
LATE = {letter: 0.99 * place - 0.001 for letter, place in PLACE.items()}


@pytest.fixture
def read(tmp_path):
    def from_text(text, *maps, name="log.dat", **choices):
        (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_measurement(tmp_path / name, column_choices(maps, **choices))

    return from_text


def edge(cycles=T + 500, period=2, **header):
    signals = ["CYCLE", "DES_POS|1", "ENC_POS|1", "CURRENT|1", "DES_POS|2", "ENC_POS|2", "CONT_DEV|2"]
    axes = ["Cycle", "X1", "X1", "X1", "Y1", "Y1", "Y1"]
    columns = [cycles, PLACE["x"], LATE["x"], T / 10, PLACE["y"], LATE["y"], PLACE["y"] - LATE["y"]]
    rows = [[int(row[0]), *map(float, row[1:])] for row in zip(*columns, strict=True)]
    listed = [{"Name": name, "Type": "DOUBLE", "Axis": axis} for name, axis in zip(signals, axes, strict=True)]
    head = {"SignalListHFData": listed, **({} if period is None else {"CycleTimeMs": period}), **header}
    block = {"HFBlockEvent": {"GCode": "G1 X0"}}
    return {"Header": head, "Payload": [{"HFData": rows[:15]}, block, {"HFData": rows[15:]}], "Footer": {}}


def trace(slow=1, number=1, extra=""):
    signals = "".join(
        f'<dataSignal id="f{k}" key="{k}" name="/Nck/!SD/nckServoData{name} [u1, {number}]" description="" '
        f'interval="0.002" unitsType="7"/>'
        for k, name in enumerate(["ActPos1stEnc64", "CtrlDev64", "ActCurr64"], 1)
    )
    rows = "".join(
        f'<rec time="{0.002 * t:.6f}" f1="{float(LATE["x"][t])!r}" f2="{float(PLACE["x"][t] - LATE["x"][t])!r}"'
        + (f' f3="{0.1 * t:.3f}"' if t % slow == 0 else "") + "/>"
        for t in range(COUNT)
    )  # fmt: skip
    return (
        f'<?xml version="1.0" encoding="ISO-8859-1"?>\n{extra}<traceSession version="2"><traceDisplaySetup/>'
        f'<traceData dataFrames="1"><dataFrame><frameHeader startTime="2023-12-22"/>{signals}{rows}'
        "</dataFrame></traceData></traceSession>"
    )


def scope(separator="\t", mark=",", stamp=False, unit="mm (Length)", end="", slow=False):
    names = ["SetPos", "ActPos", "ActCurrent"]
    symbols = [f"Axes.Axis X.{name}" for name in names]
    block = {"Name": names, "SymbolName": symbols, "SampleTime[ms]": ["1"] * 3, "Unit": [unit, unit, "(None)"]}
    lines = ["Name\tproject", "File\tlog.csv", "Starttime of export\t132959733843760000\tMontag", "", ""]
    lines += ["\t".join([key, *cells[:2], key, cells[2]]) for key, cells in block.items()] + [""]
    for t in range(COUNT):
        time = f"{132959733843760000 + 20000 * t}" if stamp else f"{2 * t}"
        later = [f"{4 * t}", f"{0.2 * t:.3f}"] if slow else [time, f"{0.1 * t:.3f}"]
        later = ["", ""] if slow and t >= COUNT / 2 else later
        lines.append("\t".join([time, f"{PLACE['x'][t]:.9f}", f"{LATE['x'][t]:.9f}", *later]))
    text = "\n".join(lines).replace(".", mark) if mark != "." else "\n".join(lines)
    text = text.replace("Axes,Axis X,", "Axes.Axis X.").replace("log,csv", "log.csv")
    return text.replace("\t", separator) + "\n" + end


PINS = "# net xc joint.0.motor-pos-cmd => sampler.0.pin.0\n# net xf joint.0.motor-pos-fb => sampler.0.pin.1\n"


def hal(first="", tags=None, lost=None):
    lines = [f"{'' if tags is None else f'{tags[t]} '}{PLACE['x'][t]:f} {LATE['x'][t]:f} " for t in range(COUNT)]
    if lost is not None:
        lines.insert(lost, "overrun")
    return first + "\n".join(lines) + "\n"


FILES = {
    "edge": json.dumps(edge()),
    "edge, gzip": gzip.compress(json.dumps(edge()).encode()),
    "trace": trace(),
    "trace, UTF-16": trace().replace("ISO-8859-1", "UTF-16").encode("utf-16"),
    "scope": scope(),
    "scope, semicolons and points": scope(";", "."),
    "scope, full time stamp, EOF": scope(stamp=True, end="EOF\n"),
    "hal": hal(PINS + "# loadrt motmod servo_period_nsec=2000000\n"),
    "hal, tagged": hal(PINS + "# sample_period: 2 ms\n", tags=T + 7),
}


@pytest.mark.parametrize("text", FILES.values(), ids=FILES)
def test_each_format_reads_into_the_columns_of_a_measurement(read, text):
    found = read(text, axis="x").columns
    np.testing.assert_allclose(found["actual"].values, LATE["x"], atol=2e-6)
    np.testing.assert_allclose(found["time"].values, 0.002 * T, atol=1e-12)
    if "target" in found:
        np.testing.assert_allclose(found["target"].values, PLACE["x"], atol=2e-6)
    else:
        np.testing.assert_allclose(found["deviation"].values, LATE["x"] - PLACE["x"], atol=2e-6)
    if "current" in found:
        assert found["current"].unit == "a"
        np.testing.assert_allclose(found["current"].values, 0.1 * T, atol=1e-9)
    assert found["actual"].unit == "mm"


def test_missing_cycles_leave_a_gap_in_time_and_are_said(read):
    m = read(json.dumps(edge(cycles=np.where(T < 20, T, T + 100))), axis="y")
    assert m.columns["time"].values[[19, 20]].tolist() == pytest.approx([0.038, 0.24])
    assert any("1 gap in the cycle numbers: 100 samples (0.2 s)" in note for note in m.notes)
    assert list(m.unknown) == ["contdev_mm"]


def test_a_period_that_is_not_stated_comes_from_the_time_stamps(read):
    log = edge(period=None)
    with pytest.raises(FileFormatError, match="the period is not known"):
        read(json.dumps(log), axis="x")
    stamps = [("2023-12-22T14:26:01.312Z", 1000), ("2023-12-22T14:26:01.912Z", 1150)]
    log["Payload"] += [{"HFTimestamp": {"Time": time, "HFProbeCounter": count}} for time, count in stamps]
    m = read(json.dumps(log), axis="x")
    assert m.columns["time"].values[1] == pytest.approx(0.004)
    assert any("4 ms by the time stamps" in note for note in m.notes)


def test_the_letter_of_an_axis_by_number_is_said(read):
    assert any("axis 2 for y" in note for note in read(trace(number=2), axis="y").notes)


def test_a_slower_channel_is_interpolated_and_that_is_said(read):
    for text, last in ((trace(slow=3), 39), (scope(slow=True), 38)):
        m = read(text, axis="x")
        np.testing.assert_allclose(m.columns["current"].values, 0.1 * np.arange(last + 1), atol=1e-9)
        assert any("interpolated linearly" in note for note in m.notes)


def test_a_nan_of_a_trace_is_a_missing_sample(read):
    broken = trace().replace('f1="' + repr(float(LATE["x"][5])), 'f1="9218868437227405312')
    times = read(broken, axis="x").columns["time"].values
    np.testing.assert_allclose(times, 0.002 * np.delete(T, 5), atol=1e-12)


def test_units_of_scope_channels_are_those_of_the_file(read):
    metres = read(scope(unit="m (Length)"), axis="x")
    np.testing.assert_allclose(metres.columns["actual"].values, 1e3 * LATE["x"], atol=1e-5)
    unknown = read(scope(unit="(None)"), axis="x")
    assert any("ActPos in mm" in note and "states no units" in note for note in unknown.notes)


def test_pins_of_hal_come_from_the_file_beside_or_from_map(read, tmp_path):
    assert "target" in read(hal(), "column 1=target_mm", "column 2=actual_mm").columns
    with pytest.raises(FileFormatError, match=r"2 columns without names.*--map 'column 1=target_mm'"):
        read(hal())
    (tmp_path / "log.hal").write_text("loadrt motmod servo_period_nsec=500000\n" + PINS.replace("# ", ""))
    m = read(hal(), axis="x")
    assert m.columns["time"].values[1] == pytest.approx(0.0005)


def test_hal_samples_that_were_lost(read):
    counted = read(hal(PINS, tags=np.where(T < 20, T, T + 50), lost=20), axis="x")
    assert counted.columns["time"].values[[19, 20]].tolist() == pytest.approx([0.019, 0.070])
    uncounted = read(hal(PINS, lost=20), axis="x")
    assert uncounted.columns["run"].values[[0, 19, 20]].tolist() == [1.0, 1.0, 2.0]
    assert uncounted.columns["time"].values[20] == 0.0


def test_machine_units_in_inch(read):
    m = read(hal(PINS + "# linear_units: inch\n"), axis="x")
    np.testing.assert_allclose(m.columns["target"].values, 25.4 * PLACE["x"], atol=1e-4)


def ragged(log):
    log["Payload"][0]["HFData"][3].pop()
    return json.dumps(log)


def falling(log):
    log["Payload"][0]["HFData"][3][0] = 1
    return json.dumps(log)


DTD = '<!DOCTYPE traceSession [<!ENTITY a "aaaa">]>'
BAD = {
    "edge, cut off": (json.dumps(edge())[:-300], "broken JSON.*cut off"),
    "edge, a short row": (ragged(edge()), "part 1 of the payload has another length.*7 values"),
    "edge, cycles fall": (falling(edge()), "cycle 1 follows cycle 502"),
    "edge, no signals": (json.dumps({"Header": {"SignalListHFData": []}, "Payload": []}), "no list"),
    "edge, no payload": (json.dumps({"Header": {"SignalListHFData": []}}), "no 'Header' and 'Payload'"),
    "edge, text": (json.dumps(edge()).replace("0.1,", '"a",', 1), "is no number"),
    "trace, cut off": (trace()[:-300], "broken XML.*cut off"),
    "trace, DTD": (trace(extra=DTD), "line 2: a document type"),
    "trace, text": (trace().replace('f3="0.100"', 'f3="ab"'), "'ab' is not a number"),
    "trace, empty": ("<traceSession></traceSession>", "no samples"),
    "scope, cut off": ("\n".join(scope().split("\n")[:9]), "0 rows of samples"),
    "scope, text": (scope().replace("\t0,100", "\tab"), "'ab' is not a number"),
    "scope, no channels": (scope().split("\n\n\n")[0], "no block of channels"),
    "hal, cut off": (hal(PINS)[:-12], "is no sample.*cut off"),
    "hal, pins": (hal(PINS + "# net z joint.2.motor-pos-fb => sampler.0.pin.2\n"), "2 columns, and 3 pins"),
    "gzip, cut off": (gzip.compress(json.dumps(edge()).encode())[:-20], "cut off"),
    "gzip, broken": (b"\x1f\x8b\x08" + bytes(40), "broken gzip"),
}


@pytest.mark.parametrize("text, problem", BAD.values(), ids=BAD)
def test_a_wrong_file_is_one_clear_error(read, text, problem):
    with pytest.raises(FileFormatError, match=problem) as caught:
        read(text, axis="x")
    assert "\n" not in str(caught.value)


def test_gzip_is_not_unpacked_beyond_the_limit(tmp_path):
    bomb = tmp_path / "bomb.gz"
    bomb.write_bytes(gzip.compress(bytes(b"1" * 5_000_000)))
    with pytest.raises(FileFormatError, match="unpacked it is too large"):
        read_any_text(bomb, most_bytes=1_000_000)
    bomb.write_bytes(gzip.compress(b"target_mm\n") + gzip.compress(b"1\n"))
    assert read_any_text(bomb)[0] == "target_mm\n1\n"


@pytest.mark.skipif(not SHARED.exists(), reason="no ../shared/data")
def test_a_log_of_siemens_edge():
    raw = json.loads(gzip.open(SHARED).read())
    names = [signal["Name"] for signal in raw["Header"]["SignalListHFData"]]
    rows = np.array([row for part in raw["Payload"] for row in part.get("HFData", [])])
    m = read_measurement(SHARED, column_choices(axis="x"))
    for column, name in (("target", "DES_POS|1"), ("actual", "ENC_POS|1"), ("current", "CURRENT|1")):
        np.testing.assert_array_equal(m.columns[column].values, rows[:, names.index(name)])
    assert m.columns["time"].values[-1] == pytest.approx(0.002 * (rows[-1, 0] - rows[0, 0]))
    assert any("3859 samples (7.72 s) are missing" in note for note in m.notes)
