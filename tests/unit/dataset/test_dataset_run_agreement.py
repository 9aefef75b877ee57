"""A run with exchanged directions, another sign or another unit is told from the others; a right one is not."""

import json

import numpy as np
import pytest

from rtec.cli import main

TARGETS = np.array([3.2, 51.9, 104.4, 149.1, 203.7, 247.3, 302.0, 355.5, 401.1, 447.8, 496.6])
NOISE, BACKLASH = 0.4, 4.0
CHANGED = {"exchanged": None, "sign": -1.0, "mm": 1e-3, "um as mm": 1e3, "inch": 25.4, "tens": 10.0}
SAID = {
    "exchanged": "its directions look exchanged",
    "sign": "its deviations seem to have the opposite sign",
    "mm": "its deviations look 1000 times too small, mm among um",
    "um as mm": "its deviations look 1000 times too large, um among mm",
    "inch": "its deviations look 25.4 times too large",
    "tens": "its deviations look 10 times too large",
}


def readings(seed, runs=5, *, wrong=(), drift=0.0, backlash=BACKLASH, ways=(1, -1), in_order=True):
    """Return rows of run, direction, target in mm and deviation in um; ``wrong``: pairs of run and what is wrong."""
    rng, rows = np.random.default_rng(seed), []
    curve = 20e-3 * TARGETS + 3.0 * np.sin(2 * np.pi * TARGETS / 170.0)
    for run in range(1, runs + 1):
        for way in ways:
            for at, y in list(zip(TARGETS, curve, strict=True))[:: way if in_order else 1]:
                away = y - way * backlash / 2 + drift * np.sqrt(len(rows)) + rng.normal(0.0, NOISE)
                factor = dict(wrong).get(run)
                changed = CHANGED[factor] if factor else 1.0
                rows.append((run, way if changed else -way, at, away * (changed or 1.0)))
    return rows


@pytest.fixture
def warnings(load):
    def said(rows):
        lines = [f"{run},{way},{at},{y:.6f}" for run, way, at, y in rows]
        return load("\n".join(["run,direction,target_mm,deviation_um", *lines]) + "\n").warnings

    return said


@pytest.mark.parametrize("drift", [0.0, 1.5])
@pytest.mark.parametrize("what", CHANGED)
def test_a_wrong_run_is_named_with_what_is_wrong_and_what_to_do(warnings, what, drift):
    for seed, runs in ((1, 3), (2, 5), (3, 10)):
        # nothing but the deviations tells it: both directions stand in ascending order
        run = 1 + seed % runs
        (text,) = warnings(readings(seed, runs, wrong=[(run, what)], drift=drift, in_order=False))
        first = 2 + (run - 1) * 2 * TARGETS.size
        assert text.startswith(
            f"lines {first} to {first + 2 * TARGETS.size - 1}, column deviation: run {run}: {SAID[what]}"
        )
        assert text.endswith(", or leave the run out")


@pytest.mark.parametrize(
    ("first", "second"), [("exchanged", "mm"), ("sign", "exchanged"), ("exchanged", "exchanged")]
)
def test_two_wrong_runs_of_five_are_both_named(warnings, first, second):
    texts = warnings(readings(4, wrong=[(2, first), (5, second)], in_order=False))
    assert [
        f"run {run}: {SAID[what]}" in text for text, run, what in zip(texts, (2, 5), (first, second), strict=True)
    ]


@pytest.mark.parametrize("what", CHANGED)
def test_of_two_runs_nobody_knows_which_is_wrong(warnings, what):
    (text,) = (one for one in warnings(readings(5, 2, wrong=[(1, what)], in_order=False)) if "disagrees" in one)
    assert "it is open which of them is wrong" in text


def test_the_order_of_targets_tells_exchanged_directions_without_any_backlash(warnings):
    (text,) = warnings(readings(6, wrong=[(4, "exchanged")], backlash=0.0))
    assert "column direction: run 4: targets fall from row to row where it says forward" in text
    assert text.endswith("its directions look exchanged; correct its direction column, or leave the run out")


def test_a_sign_that_only_the_backlash_shows_may_be_exchanged_directions(warnings):
    rows = [(run, way, at, (-1 if run == 3 else 1) * (y - 20e-3 * at)) for run, way, at, y in readings(7)]
    flat = [
        (run, way, at, y - 3.0 * np.sin(2 * np.pi * at / 170.0) * (-1 if run == 3 else 1)) for run, way, at, y in rows
    ]
    (text,) = warnings(flat)
    assert "its directions look exchanged, or its sign opposite" in text


@pytest.mark.parametrize("seed", range(8))
def test_right_runs_stay_unnamed(warnings, seed):
    offset = lambda run: 30.0 * (run == 2)
    assert warnings(readings(seed, 2 + seed, drift=2.0 * (seed % 3), backlash=[0.0, 0.1, 20.0][seed % 3])) == ()
    assert warnings([(*row[:3], row[3] + offset(row[0])) for row in readings(seed, 5)]) == ()
    assert warnings(readings(seed, 4, ways=(1,))) == ()


def test_every_command_says_what_speaks_against_a_file(tmp_path, capsys):
    file = tmp_path / "x.csv"
    lines = [f"{run},{way},{at},{y:.6f}" for run, way, at, y in readings(8, wrong=[(3, "exchanged"), (4, "mm")])]
    file.write_text("\n".join(["run,direction,target_mm,deviation_um", *lines]) + "\n")
    told = []
    for verb in (
        ["diagnose"],
        ["compare"],
        ["iso230"],
        ["add", "backlash", "-o", str(tmp_path / "m.toml"), "--force"],
    ):
        at = verb[:2] if verb[0] == "add" else verb
        assert main([*at, str(file), *verb[2:], "--json"]) == 0
        told.append([text for text in json.loads(capsys.readouterr().out)["warnings"] if ": run " in text])
        assert main([*at, str(file), *verb[2:]]) == 0
        err = capsys.readouterr().err
        assert all(f"warning: {text}\n" in err for text in told[-1])
    assert len(told[0]) == 2
    assert all(texts == told[0] for texts in told)
