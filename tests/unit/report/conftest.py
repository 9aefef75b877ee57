"""A small study with made-up results: nothing is simulated, every number is known."""

from __future__ import annotations

from dataclasses import fields as dataclass_fields, replace

import numpy as np
import pytest

from rtec.controller import Receiver, ReceiverSettings
from rtec.injector import Insertions
from rtec.machine import Ending, LoopResult
from rtec.metrology import Readings, positioning_figures
from rtec.requester.status import Status
from rtec.signal import EdgeStream
from rtec.study import builtin_study
from rtec.study.definition import Study
from rtec.study.results import FeedCurve, HoldCurve, Limit, StudyResult, StudyRow, TruthScore, Waveform

PERIOD_MM = 5.0
TARGETS_MM = np.arange(12) * 3.2
LATHE = builtin_study()
SMALL = replace(
    LATHE, name="small", title="x axis of nothing", unit="um", repeatability_mm=0.001, period_mm=PERIOD_MM,
    predictor="lathe", left_out=(), plan=replace(LATHE.plan, feed_mm_s=21.0),
    hold_growth_mm=0.010, seed=7,
)  # fmt: skip


def readings(error_mm: float, *, runs: int = 5, directions: tuple[int, ...] = (1, -1)) -> Readings:
    """Return readings whose mean is ``error_mm`` in reverse and minus that forward, with a wave of a tenth of it."""
    columns = []
    for run in range(1, runs + 1):
        for direction in directions:
            targets = TARGETS_MM[::direction]
            wave = 0.1 * error_mm * np.sin(2 * np.pi * targets / PERIOD_MM)
            scatter = 0.01 * error_mm * (run - (runs + 1) / 2)
            deviation = -direction * error_mm + wave + scatter
            columns.append((targets, deviation, np.full(12, direction), np.full(12, run)))
    target, deviation, direction_, run_ = (np.concatenate(column) for column in zip(*columns, strict=True))
    return Readings(target_mm=target, deviation_mm=deviation, direction=direction_, run=run_)


def machine_run(*, illegal_transitions: int = 0, **changes: object) -> LoopResult:
    """Return what a machine has counted whose corrections all came through."""
    insertions = Insertions(
        requested=12345, completed=12345, inserted=12345, refused=0, ahead_counts=49380, illegal=0, real_inside=0,
        longest_ps=0,
    )  # fmt: skip
    received = replace(
        Receiver(ReceiverSettings(), initial=0).result(at_ps=0), illegal_transitions=illegal_transitions
    )
    fields = {
        "ending": Ending.FINISHED,
        "deviation_mm": np.empty(0),
        "insertions": insertions,
        "received": received,
        "encoder_counts": 0,
        "controller_counts": 49380,
        "step_counts": 4,
        "wanted_steps": 12345,
        "pending_steps": 0,
        "beyond_word_steps": 0,
        "status": Status.OK,
        "refused": 0,
        "exchanges": 100,
        "not_valid": 0,
        "audit_counts": 0,
        "following_max_mm": 0.0,
        "ticks": 0,
        "ticks_skipped": 0,
        "simulated_s": 3600.0,
        "wall_s": 0.1,
        "trace": None,
    }
    return LoopResult(**{**fields, **changes})


def study_row(name: str, error_mm: float, **changes: object) -> StudyRow:
    """Return a row; ``changes`` overrides fields of it or of its run, ``runs`` and ``directions`` its readings."""
    runs, directions = changes.pop("runs", 5), changes.pop("directions", (1, -1))
    taken = readings(error_mm, runs=runs, directions=directions)
    fields = {
        "name": name,
        "title": name.capitalize(),
        "readings": taken,
        "figures": positioning_figures(taken, period=PERIOD_MM),
        "reason": "",
    }
    own = {key: changes.pop(key) for key in list(changes) if key in fields}
    return StudyRow(**{**fields, **own}, run=machine_run(**changes))


def waveform(name: str) -> Waveform:
    """Return Design C's two counts behind the third of six forward edges, levels written out by hand."""
    us = 1_000_000
    encoder = EdgeStream(np.arange(1, 7) * 10 * us, [1, 3, 2, 0, 1, 3], initial=0)
    # A and B differ after the third edge, so B is inverted first, then A: level 2 becomes 0, then 1
    times = np.array([10, 20, 30, 33, 34, 40, 50, 60]) * us
    controller = EdgeStream(times, [1, 3, 2, 0, 1, 3, 2, 0], initial=0)
    return Waveform(
        name=name,
        processor="8051",
        encoder=encoder,
        controller=controller,
        from_ps=5 * us,
        to_ps=65 * us,
        inserted_ps=(33 * us, 34 * us),
        counts_added=2,
    )


def study_result(**changes: object) -> StudyResult:
    """Return the study; ``changes`` overrides its fields, and those of its definition."""
    feed = np.array([2.0, 10.0, 30.0])
    position = np.linspace(0.0, 35.2, 200)
    fields = {
        "facts": (("Encoder", "1 µm a count"),),
        "learned": None,
        "predictor_score": TruthScore(rms_mm=0.0012, worst_mm=0.0031),
        "position_mm": position,
        "forward_error_mm": -0.05 + 0.005 * np.sin(2 * np.pi * position / PERIOD_MM),
        "reverse_error_mm": 0.05 + 0.005 * np.sin(2 * np.pi * position / PERIOD_MM),
        "rows": (study_row("uncompensated", 0.05), study_row("original", 0.004), study_row("c", 0.002)),
        "feed_curves": tuple(
            FeedCurve(
                name=name,
                feed_mm_s=feed,
                forward_pp_mm=feed / 1000.0,
                reverse_pp_mm=feed / 500.0,
                forward_rms_mm=feed / 4000.0,
                reverse_rms_mm=feed / 3000.0,
                follows_up_to_mm_s=12.0,
            )
            for name in ("original", "c")
        ),
        "hold_curves": tuple(
            HoldCurve(
                name=name,
                state=2,
                time_s=np.arange(50.0),
                deviation_mm=np.linspace(0.0, 0.009, 50),
                inserted=0,
                pending_steps=2,
            )
            for name in ("original", "c")
        ),
        "command": "rtec run",
        "waveforms": (waveform("c"),),
        "limits": (
            Limit(
                name="original",
                follows_up_to_mm_s=25.0,
                gate_refuses_above_mm_s=96.0,
                word_holds_mm=0.508,
                largest_error_mm=0.055,
            ),
            Limit(
                name="c",
                follows_up_to_mm_s=12.0,
                gate_refuses_above_mm_s=float("inf"),
                word_holds_mm=0.054,
                largest_error_mm=0.055,
            ),
        ),
        "wall_s": 1.0,
        "warnings": (),
    }
    names = {item.name for item in dataclass_fields(Study)} - fields.keys()
    of_study = {name: changes.pop(name) for name in names & changes.keys()}
    return StudyResult(**{"study": replace(SMALL, **of_study), **fields, **changes})


@pytest.fixture
def make_row():
    return study_row


@pytest.fixture(scope="session")
def make_result():
    return study_result


@pytest.fixture
def out(tmp_path):
    """Return an empty folder for a report."""
    place = tmp_path / "out"
    place.mkdir()
    return place
