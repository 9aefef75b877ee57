"""Small diagnoses made by hand: every number is known, nothing is searched."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rtec.dataset.dataset import Dataset
from rtec.effects import Conditions, CyclicShape, Observable, Shape, Units, distance_since_reversal
from rtec.effects.backlash import backlash
from rtec.effects.cyclic import Cyclic
from rtec.inference.compare import Comparison, Stretch, Where
from rtec.inference.model import Model, Term
from rtec.inference.results import Candidate, Cosines, Diagnosis, Experiment, NoiseFloor, Step, Value, Verdict

PERIOD_MM = 6.35
SIGMA_MM = 0.001
BACKLASH_MM = 0.012
UNITS = Units("mm", "mm", "s")
CYCLIC = CyclicShape(period=PERIOD_MM, harmonics=1, by_direction=False)
TERMS = (
    Term(effect=backlash, shape=Shape(), amplitudes=(BACKLASH_MM,), errors=(0.0002,)),
    Term(effect=Cyclic(), shape=CYCLIC, amplitudes=(0.003, 0.004), errors=(1e-4, 1e-4)),
)


def static_conditions(runs: int = 5, targets: int = 21, *, directions: tuple[int, ...] = (1, -1)) -> Conditions:
    """Return a bidirectional static test, targets at no multiple of anything."""
    places = np.linspace(0.0, 400.0, targets) + np.random.default_rng(3).uniform(-3, 3, targets)
    position, direction, run = [], [], []
    for number in range(1, runs + 1):
        for way in directions:
            position.append(places[::way])
            direction.append(np.full(targets, float(way)))
            run.append(np.full(targets, number))
    x, way, n = np.concatenate(position), np.concatenate(direction), np.concatenate(run)
    time_s = 8.0 * np.arange(x.size)
    return Conditions(
        position=x,
        position_unit="mm",
        run=n,
        direction=way,
        time_s=time_s,
        since_reversal=distance_since_reversal(x, way, n),
        temperatures={"temperature": 20.0 + 2.0 * (1 - np.exp(-time_s / 600.0))},
        screw_pitch=PERIOD_MM,
    )


def dataset_of(conditions: Conditions, *, terms: tuple[Term, ...] = TERMS, **changes: object) -> Dataset:
    """Return what ``terms`` and noise give under these conditions."""
    rng = np.random.default_rng(11)
    observed = rng.normal(0.0, SIGMA_MM, conditions.rows) + sum(term.contribution(conditions) for term in terms)
    way = np.zeros(conditions.rows) if conditions.direction is None else conditions.direction
    _, cell = np.unique(np.stack([conditions.position, way]), axis=1, return_inverse=True)
    fields = {
        "source": "axis.csv",
        "observe": "deviation",
        "observable": Observable.DEVIATION,
        "units": UNITS,
        "observed": observed,
        "conditions": conditions,
        "cell": cell.reshape(-1).astype(np.int64),
        "notes": ("Row order and time agree.",),
    }
    return Dataset(**{**fields, **changes})


def step_of(effect: str, rms_train: float, **changes: object) -> Step:
    """Return a step with made-up numbers."""
    fields = {
        "effect": effect,
        "params": (),
        "rms_train": rms_train,
        "rms_heldout": 1.05 * rms_train,
        "gain": 2e-5,
        "gain_error": 1e-6,
        "p_adjusted": 1e-6,
        "reason": "held-out error falls by 20 standard errors",
        "model": Model(observe="deviation", units=UNITS),
    }
    return Step(**{**fields, **changes})


def candidate_of(effect: str, **changes: object) -> Candidate:
    """Return a candidate with made-up numbers, not accepted."""
    fields = {
        "effect": effect,
        "accepted": False,
        "predicted_rms": 0.00098,
        "achieved_rms": None,
        "p_adjusted": 0.4,
        "params": (),
        "tied_with": (),
        "cosine": None,
        "reason": "p 0.4 is not below 0.01",
    }
    return Candidate(**{**fields, **changes})


def noise_of(**changes: object) -> NoiseFloor:
    """Return the noise floor of the examples."""
    fields = {
        "from_repeats": True,
        "sigma": SIGMA_MM,
        "correlation": 0.0,
        "white_share": 1.0,
        "degrees_of_freedom": 168.0,
        "sigma_adjacent": None,
    }
    return NoiseFloor(**{**fields, **changes})


def diagnosis_of(**changes: object) -> Diagnosis:
    """Return a search that found backlash and a cyclic error, tried a scale and took it out again."""
    dataset = changes.pop("dataset", None) or dataset_of(static_conditions())
    start = Model(observe="deviation", units=UNITS)
    backlash = (Value("backlash", 12.0, 0.2, "um"),)
    cyclic = (Value("period", PERIOD_MM, 0.002, "mm"), Value("harmonics", 1.0, None, ""),
              Value("amplitude_1", 5.0, 0.1, "um"))  # fmt: skip
    scale = (Value("scale", 1.5, 0.5, "um/m"),)
    fields = {
        "verdict": Verdict.NAMED,
        "dataset": dataset,
        "heldout": None,
        "start": start,
        "model": start.with_terms(TERMS),
        "steps": (
            step_of("scale", 0.0068, params=scale),
            step_of("backlash", 0.0037, params=backlash),
            step_of("cyclic", 0.00099, params=cyclic),
        ),
        "candidates": (
            candidate_of("backlash", accepted=True, predicted_rms=0.0038, achieved_rms=0.0037, p_adjusted=1e-9,
                         params=backlash, tied_with=("windup",), cosine=0.99, reason="named"),
            candidate_of("cyclic", accepted=True, predicted_rms=0.0011, achieved_rms=0.00099, p_adjusted=1e-9,
                         params=cyclic, reason="named"),
            candidate_of("scale", params=scale, reason="not needed"),
            candidate_of("drift", p_adjusted=0.2),
        ),
        "noise": noise_of(),
        "rms_before": 0.0070,
        "rms_after": 0.0010,
        "rms_heldout": 0.00104,
        "heldout_by": "run",
        "not_testable": (("servo_lag", "no velocity or feed column"), ("interpolation", "no scale signal period")),
        "minimum_detectable": (("backlash", 0.0003), ("thermal_growth", 0.0004)),
        "lack_of_fit": (("position and direction", 0.4), ("time", 0.2)),
        "unknown": None,
        "cosines": Cosines(
            names=("backlash", "scale", "windup"),
            cosine=np.array([[1.0, 0.02, 0.98], [0.02, 1.0, float("nan")], [0.98, float("nan"), 1.0]]),
        ),
        "experiment": Experiment(text="Measure dense points just after a reversal."),
        "notes": ("The score test is calibrated with 400 draws.",),
    }  # fmt: skip
    return Diagnosis(**{**fields, "dataset": dataset, **changes})


def comparison_of(**changes: object) -> Comparison:
    """Return what the model of the examples leaves, with made-up figures."""
    dataset = changes.pop("dataset", None) or dataset_of(static_conditions())
    model = Model(observe="deviation", units=UNITS, terms=TERMS)
    worst = Stretch(low=10.0, high=20.0, direction=-1, mean=0.002, rms=0.0025, rows=10)
    fields = {
        "dataset": dataset,
        "heldout": None,
        "model": model,
        "stated": (False,) * len(TERMS),
        "residual": dataset.observed - model.predict(dataset),
        "rms": 0.0015,
        "rms_heldout": 0.0016,
        "heldout_by": "run",
        "noise": noise_of(),
        "where": (
            Where(quantity="position", unit="mm", share=0.6, worst=(worst,)),
            Where(quantity="direction", unit="", share=0.3, worst=(replace(worst, low=-1.0, high=-1.0, rows=105),)),
            Where(quantity="run", unit="", share=0.02, worst=()),
        ),
    }
    return Comparison(**{**fields, **changes})


@pytest.fixture
def make_diagnosis():
    return diagnosis_of


@pytest.fixture
def make_dataset():
    return lambda **changes: dataset_of(changes.pop("conditions", None) or static_conditions(), **changes)


@pytest.fixture
def make_candidate():
    return candidate_of


@pytest.fixture
def make_noise():
    return noise_of


@pytest.fixture
def make_step():
    return step_of


@pytest.fixture
def make_comparison():
    return comparison_of
