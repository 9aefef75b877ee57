"""A metrologist has an axis measured before and after compensation, in files of laser and spreadsheet."""

import csv
import datetime
import io
import json

import numpy as np
import openpyxl
import pytest
from iso230_oracle import oracle_figures
from vdi3441_oracle import oracle_vdi

PITCH_MM = 10.0
"""Of the screw; she knows it from its data sheet."""
TARGETS_MM = np.round(40.0 * np.arange(11) + np.random.default_rng(3).uniform(0.0, 10.0, 11), 1)
"""As ISO 230-2 asks: on a grid and beside it by chance, so that nothing periodic hides."""
TITLE = "Positioniergenauigkeit X-Achse;;;;;\r\nMaschine:;Fräszentrum 3;;;;\r\nPrüferin:;M. Köhler;;;;\r\n;;;;;\r\n"
HEADINGS = ("Datum", "Uhrzeit", "Lauf", "Richtung", "Position [mm]", "Abweichung (µm)")


def measured(*, backlash_um, scale_um_m, cyclic_um, seed):
    """Return run, direction, target (mm) and deviation (to 0.01 µm, noise 0.5 µm) of five bidirectional runs."""
    noise = np.random.default_rng(seed)
    rows = []
    for run in range(1, 6):
        for way in (1, -1):
            for x in TARGETS_MM[::way]:
                error = scale_um_m * x / 1000 + cyclic_um * np.sin(2 * np.pi * x / PITCH_MM) - way * backlash_um / 2
                rows.append((run, way, float(x), round(float(error + noise.normal(0.0, 0.5)), 2)))
    return rows


BEFORE = measured(backlash_um=12.0, scale_um_m=30.0, cyclic_um=4.0, seed=1)
AFTER = measured(backlash_um=1.5, scale_um_m=0.0, cyclic_um=4.0, seed=2)


def comma(value, decimals):
    return f"{value:.{decimals}f}".replace(".", ",")


def spreadsheet(rows, headings=HEADINGS, per_um=1.0, decimals=2):
    """Return a test as a German spreadsheet writes it."""
    clock = datetime.datetime(2026, 3, 12, 8, 30)
    lines = [";".join(headings)]
    for run, way, x, error in rows:
        clock += datetime.timedelta(seconds=12)
        numbers = f"{comma(x, 1)};{comma(error * per_um, decimals)}"
        lines.append(f"{clock:%d.%m.%Y;%H:%M:%S};{run};{'+' if way > 0 else '-'};{numbers}")
    return (TITLE + "\r\n".join(lines) + "\r\n").encode("windows-1252")


def figures_of(file):
    """Return her own sums over the numbers of such a file, in µm, and those of VDI/DGQ 3441."""
    table = list(csv.reader(io.StringIO(file.read_bytes().decode("windows-1252")), delimiter=";"))[5:]
    target, error = (np.array([float(row[k].replace(",", ".")) for row in table]) for k in (4, 5))
    way = np.array([int(row[3] + "1") for row in table])
    return oracle_figures(target, error, way), oracle_vdi(target, error, way)


@pytest.fixture
def tests(tmp_path):
    for name, rows in (("before.csv", BEFORE), ("after.csv", AFTER)):
        (tmp_path / name).write_bytes(spreadsheet(rows))
    return tmp_path


def test_before_and_after_on_one_sheet(rtec, tests):
    found = json.loads(rtec("iso230", "before.csv", "after.csv", "-o", "report", "--json").stdout)
    for name, one in zip(("before.csv", "after.csv"), found["files"], strict=True):
        iso, vdi = figures_of(tests / name)
        assert (one["name"], one["unit"], one["targets"], one["runs"]) == (name, "um", 11, 5)
        assert {key: one[key] for key in iso} == pytest.approx(iso, rel=1e-9)
        assert one["vdi3441"] == pytest.approx(vdi, rel=1e-9)
        assert one["warnings"] == []
    assert (tests / "report/report.pdf").read_bytes().startswith(b"%PDF")
    assert (tests / "report/figures/positioning.png").read_bytes().startswith(b"\x89PNG")
    picture = (tests / "report/figures/positioning.svg").read_text(encoding="utf-8")
    page = (tests / "report/report.html").read_text(encoding="utf-8")
    for name, one in zip(("before.csv", "after.csv"), found["files"], strict=True):
        assert name in picture
        assert all(f"{one[key]:.1f}" in page for key in "AREMB")
        assert f"{one['vdi3441']['P']:.1f}" in page


def test_a_workbook_asks_which_sheet(typed, tmp_path):
    axes = {"Y-Achse": (3.0, 4), "Z-Achse": (8.0, 5)}
    book = openpyxl.Workbook()
    book.remove(book.active)
    rows = {}
    for name, (backlash, seed) in axes.items():
        rows[name] = measured(backlash_um=backlash, scale_um_m=10.0, cyclic_um=1.0, seed=seed)
        sheet = book.create_sheet(name)
        for line in (["Positionsmessung"], [], ["Lauf", "Richtung", "Soll [mm]", "Ist [mm]"]):
            sheet.append(line)
        for run, way, x, error in rows[name]:
            sheet.append([run, "+" if way > 0 else "-", x, x + error / 1000])
    book.save(tmp_path / "achsen.xlsx")
    asked = typed("iso230", "achsen.xlsx", code=2).stderr
    assert "--sheet 'Y-Achse'" in asked
    assert "Z-Achse" in asked
    found = json.loads(typed("iso230", "achsen.xlsx", "--sheet", "Z-Achse", "--json").stdout)
    _, way, target, error = np.array(rows["Z-Achse"]).T
    iso = oracle_figures(target, error, way)
    assert {key: found[key] for key in "AREMB"} == pytest.approx({key: iso[key] for key in "AREMB"}, rel=1e-9)


def test_headings_that_rtec_asks_about_are_answered(typed, tmp_path):
    """Each message holds the words to type next."""
    headings = (*HEADINGS[:4], "Prüfpunkt", "Messwert")
    rows = [(run, way, x, 1000 * x + error) for run, way, x, error in BEFORE]
    (tmp_path / "z.csv").write_bytes(spreadsheet(rows, headings, per_um=0.001, decimals=5))
    asked = typed("iso230", "z.csv", code=2).stderr
    assert "--map 'Messwert=actual_mm'" in asked
    asked = typed("iso230", "z.csv", "--map", "Messwert=actual_mm", code=2).stderr
    assert "--map 'Prüfpunkt=target_mm'" in asked
    answered = typed("iso230", "z.csv", "--map", "Messwert=actual_mm", "--map", "Prüfpunkt=target_mm", "--json")
    _, way, target, error = np.array(BEFORE).T
    assert json.loads(answered.stdout)["E"] == pytest.approx(oracle_figures(target, error, way)["E"], rel=1e-9)


def test_the_effects_are_named_and_what_changed(typed, tests):
    found = json.loads(typed("diagnose", "before.csv", "after.csv", "--screw-pitch", "10 mm", "--json").stdout)
    before, after = found["files"]
    assert (before["verdict"], set(before["effects"])) == ("NAMED", {"scale", "backlash", "cyclic"})
    assert (after["verdict"], set(after["effects"])) == ("NAMED", {"backlash", "cyclic"})
    planted = {("scale", "scale"): 30.0, ("backlash", "backlash"): -12.0, ("cyclic", "amplitude_1"): 4.0}
    for (effect, parameter), size in planted.items():
        value, error, _ = before["final"][effect][parameter]
        assert abs(value - size) < 4 * error < 0.1 * abs(size), (effect, value, error)
    outcomes = {(one["effect"], one["parameter"]): one["outcome"] for one in found["changes"]}
    assert outcomes["backlash", "backlash"] == "differs"
    assert outcomes["scale", "scale"] == "gone"
    assert outcomes["cyclic", "amplitude_1"] == "same"
