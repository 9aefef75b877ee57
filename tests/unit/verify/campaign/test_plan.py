"""Plans: products, ranges, draws, conditions, and what is refused."""

import math
from collections import Counter

import numpy as np
import pytest

from rtec.errors import RtecError
from rtec.verify.campaign.plan import BUILT_IN, read_plan


@pytest.fixture
def plan_of(tmp_path):
    def read(text):
        file = tmp_path / "mine.toml"
        file.write_text(f'job = "tests.campaign_jobs:KIND"\n{text}', encoding="utf-8")
        return read_plan(str(file))

    return read


def values(plan, name):
    return [job.parameters[name] for job in plan.jobs()]


def test_a_plan_is_the_product_of_its_values_and_runs(plan_of):
    plan = plan_of('runs = 2\n[try]\nfate = ["pass", "fail"]\nsize = ["1 mm", "250 um", "0.1 inch"]')
    assert plan.size == 12
    found = Counter((job.parameters["fate"], job.parameters["size_mm"], job.run) for job in plan.jobs())
    assert found == Counter(
        (fate, size, run) for fate in ("pass", "fail") for size in (1.0, 0.25, 2.54) for run in (0, 1)
    )


def test_points_of_a_range_lie_at_equal_steps_or_equal_ratios(plan_of):
    linear = plan_of('[try]\nsize = { from = "1 mm", to = "9 mm", points = 5 }')
    assert values(linear, "size_mm") == pytest.approx([1, 3, 5, 7, 9])
    ratios = plan_of('[try]\nsize = { from = "10 um", to = "10 mm", points = 4, spacing = "log" }')
    assert values(ratios, "size_mm") == pytest.approx([0.01, 0.1, 1, 10])
    whole = plan_of("[try]\nlevel = { from = 0, to = 3, points = 7 }")
    assert values(whole, "level") == [0, 1, 2, 3]


def test_draws_stay_in_range_and_are_those_of_the_seed(plan_of):
    text = 'runs = 200\n[try]\nsize = {{ from = "1 mm", to = "2 mm", draw = "{}" }}'
    for draw in ("random", "latin"):
        plan = plan_of(text.format(draw))
        drawn = values(plan, "size_mm")
        assert all(1.0 <= one <= 2.0 for one in drawn)
        assert len(set(drawn)) == 200
        assert drawn == values(plan_of(text.format(draw)), "size_mm")
        assert drawn != values(plan_of(f"seed = 2\n{text.format(draw)}"), "size_mm")


def test_a_latin_hypercube_has_one_value_in_each_stratum_of_each_parameter(plan_of):
    plan = plan_of(
        'runs = 64\n[try]\nsize = { from = "1 um", to = "1 mm", draw = "latin", spacing = "log" }\n'
        'wait = { from = "0 s", to = "1 s", draw = "latin" }'
    )
    sizes = np.log(values(plan, "size_mm"))
    strata = np.floor((sizes - math.log(1e-3)) / (math.log(1.0) - math.log(1e-3)) * 64)
    assert sorted(strata) == list(range(64))
    assert sorted(np.floor(np.multiply(values(plan, "wait_s"), 64))) == list(range(64))


def test_every_combination_of_the_grid_meets_the_same_draws(plan_of):
    plan = plan_of('runs = 9\n[try]\nfate = ["pass", "fail"]\nsize = { from = "1 mm", to = "2 mm", draw = "latin" }')
    drawn = {(job.parameters["fate"], job.run): job.parameters["size_mm"] for job in plan.jobs()}
    assert all(drawn["pass", run] == drawn["fail", run] for run in range(9))


def test_conditions_leave_combinations_out(plan_of):
    plan = plan_of(
        '[try]\nfate = ["pass", "fail"]\nlevel = [1, 2, 3]\n'
        '[[only]]\nif = { fate = "fail" }\nlevel = [1]\n[[only]]\nlevel = [1, 2]'
    )
    assert [(job.parameters["fate"], job.parameters["level"]) for job in plan.jobs()] == [
        ("pass", 1), ("pass", 2), ("fail", 1)
    ]  # fmt: skip


def test_words_leave_values_out(plan_of):
    plan = plan_of('[try]\nfate = ["pass", "fail", "die"]\nlevel = [1, 2, 3]')
    assert set(values(plan.only(["fail", "pass"]), "fate")) == {"pass", "fail"}
    assert set(values(plan.only(["end=bad"]), "fate")) == {"die"}
    small = plan.only(["fate=fail", "level=2"])
    assert (values(small, "fate"), values(small, "level")) == (["fail"], [2])


def test_a_job_that_can_prove_nothing_is_left_out(plan_of):
    plan = plan_of('[try]\nfate = ["pass", "never"]')
    assert values(plan, "fate") == ["pass"]
    with pytest.raises(RtecError, match=r"no job of it can prove anything.*it never comes to pass"):
        list(plan.only(["never"]).jobs())


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("rums = 3", r"unknown key 'rums'.*did you mean 'runs'"),
        ("[try]\nsizes = 3", r"unknown key 'try.sizes'.*did you mean 'size'"),
        ('[try]\nfate = "pas"', r"try.fate: 'pas'.*did you mean 'pass'"),
        ('[try]\nsize = "3"', r"try.size: .*unit"),
        ('[try]\nsize = "3 Hz"', r"try.size: "),
        ('[try]\nsize = "30 mm"', r"try.size: 30 mm is too large; use 0 to 10 mm"),
        ("[try]\nlevel = 200", r"try.level: 200 is too large"),
        ("[try]\nfate = []", r"try.fate: an empty list"),
        ('[try]\nfate = { from = "a", to = "b" }', r"try.fate: a table; use words"),
        ('[try]\nsize = { from = "1 mm", to = "2 mm" }', r"'points'"),
        ('[try]\nsize = { from = "2 mm", to = "1 mm", points = 2 }', r"size.to: 1 mm is not above it"),
        ('[try]\nsize = { from = "0 mm", to = "1 mm", points = 2, spacing = "log" }', r"has no logarithm"),
        ('[try]\nsize = { from = "0 mm", to = "1 mm", draw = "latim" }', r"did you mean 'latin'"),
        ('[try]\nsize = { from = "0 mm", to = "1 mm", draw = "latin", points = 2 }', r"does not go with draw"),
        ('by = ["fates"]', r"by: 'fates'.*did you mean 'fate'"),
        ("[[only]]\nif = {}", r"keeps everything"),
        ('[[only]]\nfates = "pass"', r"unknown key 'only.fates'"),
        ("runs = 0", r"runs: 0 is too small"),
        ("seed = -1", r"seed"),
    ],
)
def test_what_is_refused(plan_of, text, said):
    with pytest.raises(RtecError, match=said):
        plan_of(text)


@pytest.mark.parametrize(
    ("word", "said"),
    [("safet", "did you mean 'safety'"), ("none.toml", "none.toml"), ("tests", "FILE.toml")],
)
def test_a_plan_that_is_not_there(word, said):
    with pytest.raises(RtecError, match=said):
        read_plan(word)


@pytest.mark.parametrize("job", ["fauld", "no.module:KIND", "tests.campaign_jobs:FATES", "tests.campaign_jobs:NONE"])
def test_a_kind_of_jobs_that_is_not_there(tmp_path, job):
    file = tmp_path / "mine.toml"
    file.write_text(f'job = "{job}"', encoding="utf-8")
    with pytest.raises(RtecError, match="job"):
        read_plan(str(file))


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in_plans_hold_jobs_with_different_addresses(name):
    jobs = list(read_plan(name).jobs())
    assert len({job.address("code") for job in jobs}) == len(jobs) > 0


def test_requirements_are_of_the_whole_plan_or_of_the_jobs_that_a_table_names(plan_of):
    tried = '[try]\nfate = ["pass", "fail"]\n'
    assert [plan_of(f'requirement = "SR-12"\n{tried}').requirement_ids({"fate": fate}) for fate in ("pass",)] == [
        ["SR-12"]
    ]
    tables = '[[requirement]]\nid = "SR-1"\n[[requirement]]\nid = "SR-2"\nif = { fate = "fail" }\n'
    plan = plan_of(f"{tried}{tables}")
    assert [plan.requirement_ids(row) for row in plan.rows()] == [["SR-1"], ["SR-1", "SR-2"]]
    assert plan_of(tried).requirement_ids({"fate": "pass"}) == []


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('requirement = "SR 1"', "requirement.id: 'SR 1'"),
        ("requirement = 12", "requirement.id: 12"),
        ('[[requirement]]\nid = "SR-1"\nif = { fat = "fail" }', "unknown key 'requirement.if.fat'"),
        ('[[requirement]]\nif = { fate = "fail" }', "requirement.id: None"),
    ],
)
def test_a_requirement_that_means_nothing_is_refused(plan_of, text, told):
    with pytest.raises(RtecError, match=told):
        plan_of(text)
