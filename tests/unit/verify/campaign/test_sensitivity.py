"""Sobol indices, against the closed form of a known function."""

import math
from dataclasses import replace

import pytest

from rtec.errors import RtecError
from rtec.verify.campaign.executors import Serial
from rtec.verify.campaign.plan import read_plan
from rtec.verify.campaign.run import addresses_of, run_campaign
from rtec.verify.campaign.sensitivity import sensitivity
from rtec.verify.campaign.store import Store

DRAWN = "\n".join(f'{name} = {{ from = -{math.pi}, to = {math.pi}, draw = "sobol" }}' for name in "xyz")


@pytest.fixture
def plan_of(tmp_path):
    def read(text, kind="ISHIGAMI"):
        file = tmp_path / "mine.toml"
        file.write_text(f'job = "tests.campaign_jobs:{kind}"\n{text}', encoding="utf-8")
        return read_plan(str(file))

    return read


def test_indices_are_those_of_the_closed_form(plan_of):
    plan = plan_of(f"runs = 1024\n[try]\n{DRAWN}")
    assert plan.size == 1024 * 5
    with Store(":memory:") as store:
        found = run_campaign(plan, store, Serial()).sensitivity
    # Saltelli et al. 2008, Global Sensitivity Analysis, Example 4.2, for a = 7, b = 0.1
    a, b = 7.0, 0.1
    variance = a**2 / 8 + b * math.pi**4 / 5 + b**2 * math.pi**8 / 18 + 0.5
    first_x, first_y = 0.5 * (1 + b * math.pi**4 / 5) ** 2 / variance, a**2 / 8 / variance
    both = 8 * b**2 * math.pi**8 / 225 / variance
    expected = {"x": (first_x, first_x + both), "y": (first_y, first_y), "z": (0.0, both)}
    assert {index.of for index in found} == {"value", "once"}  # what never changes has no variance to split
    assert all(index.total_95 is None for index in found if index.of == "once")
    for index in (one for one in found if one.of == "value"):
        first, total = expected[index.parameter]
        assert (index.first, index.total) == pytest.approx((first, total), abs=0.03)
        assert index.first_95[0] - 0.01 <= first <= index.first_95[1] + 0.01
        assert index.total_95[0] - 0.01 <= total <= index.total_95[1] + 0.01


def test_a_combination_that_lacks_a_record_has_no_indices(plan_of):
    plan = plan_of(f"runs = 16\n[try]\n{DRAWN}")
    with Store(":memory:") as store:
        run_campaign(plan, store, Serial())
        records = list(store.records(addresses_of(plan)))
    assert {index.parameter for index in sensitivity(plan, records)} == set("xyz")
    assert list(sensitivity(plan, records[1:])) == []


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (f"runs = 100\n[try]\n{DRAWN}", "runs: 100 is none; use a power of two"),
        (DRAWN.replace('"sobol"', '"latin"', 1).join(["runs = 4\n[try]\n", ""]), "sobol for some parameters"),
    ],
)
def test_what_is_refused(plan_of, text, said):
    with pytest.raises(RtecError, match=said):
        plan_of(text)


def test_other_runs_are_checked_too(plan_of):
    with pytest.raises(RtecError, match="power of two"):
        replace(plan_of(f"runs = 4\n[try]\n{DRAWN}"), runs=5)
