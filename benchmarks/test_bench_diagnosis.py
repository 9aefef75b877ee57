"""Speed of the scan and of a diagnosis; the scan finds what refitting every candidate finds."""

import pytest
from diagnosis_job import agree, by_lstsq, by_scan, scan_job

from rtec.blind.game import play
from rtec.blind.scenario import Scenario
from rtec.dataset.load import load_dataset
from rtec.inference.diagnose import diagnose


@pytest.fixture(scope="module")
def job():
    return scan_job(runs=1)


def test_the_scan_finds_what_least_squares_of_every_candidate_finds(job):
    assert agree(by_scan(*job), by_lstsq(*job))


def test_speed_of_a_scan(benchmark, job):
    assert benchmark(by_scan, *job).candidates > 2000


def test_speed_of_a_diagnosis(benchmark):
    measurement, secret = play(Scenario(names=("scale", "backlash"), strength_sigma=3.0), seed=5)
    assert set(benchmark(diagnose, load_dataset(measurement)).effects) == set(secret.names)
