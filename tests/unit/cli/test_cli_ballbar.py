"""rtec ballbar: the document, the report, emulated drives, and what it refuses."""

import json

import numpy as np
import pytest

VERB = "ballbar"
WAY = np.arange(0.0, 360.0, 0.5)


@pytest.fixture
def file(tmp_path):
    shape = 4.0 * np.sin(np.radians(2.0 * WAY)) + 20.0 * np.cos(np.radians(WAY))
    noise = np.random.default_rng(1).normal(0.0, 0.3, (2, WAY.size))
    rows = [
        f"{angle:.2f},{value:.4f},{sense}"
        for sense, more in ((1, noise[0]), (-1, noise[1]))
        for angle, value in zip(WAY, shape + more, strict=True)
    ]
    path = tmp_path / "circle.csv"
    path.write_text("\n".join(["angle_deg,deviation_um,sense", *rows]))
    return path


def test_a_measured_circle(answer, file, tmp_path):
    document = answer(file, "--radius", "100mm", "-o", tmp_path / "out")
    (error,) = document["errors"]
    assert (error["name"], error["unit"], error["share"]) == ("squareness", "um/m", 1.0)
    assert error["value"] == pytest.approx(80.0, rel=0.03)
    assert document["G_b"] == pytest.approx(9.4, abs=0.8)
    assert document["centre_um"][0] == pytest.approx(20.0, abs=0.1)
    report = (tmp_path / "out" / "report.html").read_text()
    assert "squareness" in report
    assert (tmp_path / "out" / "figures" / "circle.png").stat().st_size > 10_000
    assert json.loads((tmp_path / "out" / "result.json").read_text())["G_b"] == document["G_b"]


def test_the_terminal_shows_figures_and_shares(said, file):
    code, out, _ = said(file, "--radius", "100 mm")
    assert code == 0
    assert "G(b)" in out
    assert "100%" in out


def test_emulated_drives_show_their_friction_and_their_cogging(answer):
    document = answer("--drive", "linear-motor", "--feed", "12 m/min")
    found = {error["name"]: error for error in document["errors"]}
    assert {"reversal spike x", "reversal spike y"} <= set(found)
    assert found["cyclic error x"]["period_mm"] == pytest.approx(12.0, rel=0.01)  # Erwinski et al. 2019
    assert found["cyclic error y"]["period_mm"] == pytest.approx(12.0, rel=0.01)
    assert not {"squareness", "backlash x", "servo mismatch"} & set(found)
    assert document["feed_mm_s"] == pytest.approx(200.0)


def test_what_it_refuses(refused, file, tmp_path):
    assert "DATA is missing" in refused()
    assert "--radius is missing" in refused(file)
    assert "does not go with --drive" in refused(file, "--drive", "ball-screw")
    assert "no such" in refused(tmp_path / "gone.csv")
    assert "--radius" in refused(file, "--radius", "0mm")
    assert "--feed" in refused("--drive", "ball-screw", "--radius", "5mm", "--feed", "200mm/s")
    file.write_text(file.read_text().replace(",-1", ",1"))
    assert "clockwise" in refused(file, "--radius", "100mm")
