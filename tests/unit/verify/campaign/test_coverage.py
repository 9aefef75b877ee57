"""Coverage: what was hit is counted, what was not has a name, and what is called impossible does not happen."""

import csv
import io
from dataclasses import replace
from itertools import product

import pytest

from rtec.report.campaign_coverage import coverage_csv, coverage_values
from rtec.verify.campaign.executors import Serial
from rtec.verify.campaign.plan import read_plan
from rtec.verify.campaign.run import addresses_of, run_campaign
from rtec.verify.campaign.store import Store

FAULTS = [
    "pc-killed", "bus-off-for-20-ms-pc-to-box", "encoder-cable-open-for-good", "a-and-b-swapped-for-good",
    "one-line-of-a-pair-broken-for-good", "glitches-for-good", "stale-data-valid-for-good",
]  # fmt: skip


@pytest.fixture(scope="module")
def campaign():
    plan = replace(read_plan("safety").only([*FAULTS, "original"]), runs=1)
    with Store(":memory:") as store:
        found = run_campaign(plan, store, Serial())
        records = [(done.job.parameters, done.record) for done in store.records(addresses_of(plan))]
    return found, records


def where(parameters, record):
    return parameters["fault"], parameters["phase"], str(record["state"]), record["direction"]


def test_every_combination_is_hit_a_hole_or_left_out_with_a_reason(campaign):
    found, records = campaign
    coverage = found.coverage
    assert coverage.dimensions == ("fault", "phase", "state", "direction")
    seen = {where(*one) for one in records if one[1]["result"] != "not activated"}
    cells = {tuple(one.values.values()): one for one in coverage.combinations()}
    assert set(cells) == set(product(FAULTS, found.plan.grid["phase"], "1234", ("positive", "negative", "rest")))
    assert {key for key, one in cells.items() if one.jobs} == seen
    assert all((one.jobs > 0) + one.hole + bool(one.reason) == 1 for one in cells.values())
    document = coverage.to_dict()
    holes = sum(len(hole["fault"]) for hole in document["holes"])
    left_out = sum(one["combinations"] for one in document["left_out"])
    assert document["hit"] == len(seen) and document["possible"] == len(seen) + holes
    assert document["possible"] + left_out == len(cells)


def test_what_is_called_impossible_does_not_happen(campaign):
    """The rules are by hand, the records from the machine."""
    found, records = campaign
    for parameters, record in records:
        if record["result"] != "not activated":
            observed = {"state": str(record["state"]), "direction": record["direction"]}
            assert found.plan.kind.unreachable({**parameters, **observed}) is None, (parameters, observed)


def test_the_table_shows_counts_and_the_file_every_combination(campaign):
    coverage = campaign[0].coverage
    values = coverage_values(coverage)
    assert values["coverage_heads"] == [
        "phase",
        "state",
        "direction positive",
        "direction negative",
        "direction rest",
    ]
    rows = {key: cells for key, cells in values["coverage_rows"]}
    assert rows["cutting", "1"][1:] == [("", ""), ("", "")]  # it only goes forwards
    hits, _, possible = rows["cutting", "1"][0][0].partition(" of ")
    assert int(hits) <= int(possible) < len(FAULTS)  # swapped lines say the same in state 1
    lines = list(csv.DictReader(io.StringIO(coverage_csv(coverage))))
    assert sum(line["hole"] == "yes" for line in lines) == coverage.possible - coverage.hit
