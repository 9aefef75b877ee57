"""Built-in plans give what the commands of old give, field by field."""

from dataclasses import replace
from itertools import product

import pytest

from firmware_model import read_hex
from rtec.blind.confusion import confusion
from rtec.blind.judged import judged
from rtec.blind.lines import the_lines
from rtec.board import Microcontroller
from rtec.injector import Design, InjectorSettings, Processor, RealEdges, Timing
from rtec.study import builtin_study, run_study
from rtec.study.jobs import LATHE, corrected_axis
from rtec.study.models import TRUTH
from rtec.verify.campaign.executors import Serial
from rtec.verify.campaign.plan import read_plan
from rtec.verify.campaign.run import addresses_of, run_campaign
from rtec.verify.campaign.store import Store
from rtec.verify.campaign.trace import trace_of
from rtec.verify.contract.built_in import BuiltIn
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.suite import check_algorithm
from rtec.verify.envelope.jobs import row_record
from rtec.verify.envelope.rows import EnvelopePlan, find_envelope
from rtec.verify.firmware.check import FirmwareCheckPlan, check_firmware
from rtec.verify.safety.jobs import episode_record, inject, trial_record
from rtec.verify.safety.matrix import MatrixPlan, Outcome, run_matrix
from rtec.verify.safety.phases import Phase, hyphened
from rtec.verify.safety.soak import SoakPlan, run_soak
from rtec.verify.safety.variants import VARIANTS, impossible, variants_named


def word_of(variant):
    return hyphened(variant.name.replace(",", ""))


def records_of(plan):
    """Records of a plan, each with the parameters and the run of its job."""
    with Store(":memory:") as store:
        campaign = run_campaign(plan, store, Serial())
        assert not campaign.raised
        return {(*one.job.parameters.values(), one.job.run): one.record for one in store.records(addresses_of(plan))}


def _expected(trial):
    """What the table of docs/safety.md says of such a trial, by hand: here nothing fails."""
    if trial.fired == 0:
        return "not activated"
    return "exempt" if trial.outcome is Outcome.UNDETECTED and trial.variant.upstream else "passed"


def test_safety_is_that_of_rtec_safety():
    faults = ("glitches", "pc-killed", "frame-corrupted")
    variants = tuple(one for name in faults for one in variants_named(name))
    phases = (Phase.CUTTING, Phase.AT_REST)
    matrix = run_matrix(
        MatrixPlan(designs=(Design.C, Design.B), phases=phases, variants=variants, seeds=1, first=0, seed=7)
    )
    wanted = {
        (
            one.design.value,
            hyphened(one.phase.value),
            hyphened(one.variant.name.replace(",", "")),
            "none",
            "none",
            one.seed,
        ): one
        for one in matrix.trials
        if impossible(one.variant, one.phase) is None
    }
    plan = replace(read_plan("safety").only([*faults, "cutting", "at-rest", "c", "b"]), runs=1, seed=7)
    found = records_of(plan)
    assert found.keys() == wanted.keys()
    for key, trial in wanted.items():
        record = dict(found[key])
        moment_ps, activated_ps = record.pop("moment_ps"), record.pop("activated_ps")
        assert (activated_ps is None) == (trial.fired == 0)
        if trial.fired:
            detected_ps = 8 * 10**12 if trial.detected_ps is None else trial.detected_ps
            assert 0 <= moment_ps <= activated_ps <= detected_ps
        where = record.pop("state"), record.pop("direction")
        assert where in {(None, None), *product((1, 2, 3, 4), ("positive", "rest"))}
        assert record == trial_record(trial)
        assert (record["outcome"], record["fired"]) == (trial.outcome.value, trial.fired)
        assert record["result"] == _expected(trial)


def test_two_faults_come_each_at_its_own_moment_and_prove_something_only_together():
    one = {"design": "c", "phase": "cutting"}
    names = "frame-lost-once-box-to-pc", "stale-data-valid-for-good"
    alone = [inject(one | {"fault": name, "second": "none"}, seed=1, run=0) for name in names]
    pair = inject(one | {"fault": names[0], "second": names[1]}, seed=1, run=0)
    assert (pair["moment_ps"], pair["second_moment_ps"]) == tuple(record["moment_ps"] for record in alone)
    assert (pair["result"], pair["outcome"]) == ("passed", "safe stop")
    # the machine stands before the second can take effect
    late = inject(one | {"fault": "frame-corrupted-for-good-pc-to-box", "second": "pc-killed"}, seed=1, run=0)
    assert (late["result"], late["outcome"]) == ("not activated", "safe stop")
    assert min(late["fired"], late["second_fired"]) == 0 < max(late["fired"], late["second_fired"])


@pytest.mark.parametrize(
    ("phase", "first", "second", "reason"),
    [
        ("cutting", "pc-killed", "pc-killed", "no second one beside itself"),
        ("cutting", "stale-data-valid-for-20-ms", "torn-position-word-for-good", "the end of one would end both"),
        ("insertion", "power-lost-for-good", "stale-data-valid-for-good", None),
        ("at-rest", "pc-killed", "glitches-for-200-ms", "an axis that stands still has none"),
        ("cutting", "pc-killed", "glitches-for-200-ms", None),
    ],
)
def test_pairs_that_cannot_be_are_left_out(phase, first, second, reason):
    said = read_plan("safety").kind.impossible({"design": "c", "phase": phase, "fault": first, "second": second})
    assert said is None if reason is None else reason in said


def test_pairs_of_faults_of_the_bus_leave_no_undetected_error_in_what_is_tried_here():
    plan = replace(read_plan("safety").only(["c", "cutting", "masquerade-for-good"]), runs=1)
    plan = replace(plan, grid={**plan.grid, "second": ("frame-lost-once-box-to-pc", "bus-off-for-20-ms-pc-to-box")})
    found = records_of(plan)
    assert len(found) == 4
    assert {record["result"] for record in found.values()} <= {"passed", "not activated"}


def test_a_soak_is_that_of_rtec_safety_soak():
    soak = run_soak(SoakPlan(hours=0.06, episode_s=60.0, seed=3))
    plan = replace(read_plan("soak").only(["a"]), seed=3)
    plan = replace(plan, runs=2, grid={**plan.grid, "length_s": (60.0,)})
    found = records_of(plan)
    for episode in soak.episodes:
        if episode.design is Design.A and episode.number < 2:
            assert found.pop(("a", 60.0, "none", episode.number)) == episode_record(episode)
    assert not found


@pytest.mark.sweep
@pytest.mark.parametrize(("design", "hold"), [(Design.ORIGINAL, "no"), (Design.C, "yes")])
def test_the_envelope_is_that_of_rtec_envelope(design, hold):
    plan = read_plan("envelope").only([design.value, "8051-12mhz", f"hold_latch={hold}"])
    old = EnvelopePlan(
        designs=[design], hold_latch=hold == "yes",
        processors=[one for one in EnvelopePlan().processors if one.name == "8051-12mhz"],
    )  # fmt: skip
    row = find_envelope(old)[0]
    (found,) = records_of(plan).values()
    assert found == row_record(row)
    document = row.to_dict()
    for key in ("max_safe_hz", "limited_by", "gate_hz", "max_jitter_ps", "trials", "summary", "waiting_loop_cycles"):
        assert found[key] == document[key]


def test_motions_find_what_a_box_without_latch_gets_wrong_and_the_stream_that_shows_it():
    plan = replace(read_plan("motions").only(["c", "fast", "adversary", "frequency=500kHz"]), runs=40)
    assert {one["outcome"] for one in records_of(plan).values()} <= {"correct", "deferred"}
    merged = replace(plan, grid={**plan.grid, "latch": ("merge",), "gate": ("off",)})
    wrong = [one for one in records_of(merged).values() if one["result"] == "failed"]
    assert wrong
    assert all(one["outcome"] in ("illegal", "undetected") and "end" in one["stream"] for one in wrong)


def test_a_check_is_that_of_rtec_check():
    plan = read_plan("check").only(["c"])
    (found,) = records_of(replace(plan, grid={**plan.grid, "tries": (50,)})).values()
    timing = Timing.of(Design.C, Processor.FAST)
    box = BuiltIn(InjectorSettings(design=Design.C, timing=timing, real_edges=RealEdges.HOLD))
    verdict = check_algorithm(box, Contract.of(Design.C), tries=50, seed=plan.seed).to_dict()
    assert (found["result"], found["outcome"], found["reason"]) == ("passed", "right", None)
    for key in ("max_inserting_hz", "max_passing_hz", "min_separation_ps", "max_delay_ps", "worst_stream"):
        assert found[key] == verdict[key]


@pytest.mark.sweep
@pytest.mark.parametrize("latch", ["yes", "no"])
def test_a_program_is_checked_as_by_rtec_firmware_check(latch):
    plan = read_plan("firmware").only(["c", "8051-12mhz"])
    grid = {**plan.grid, "tries": (50,), "phases": (1,), "hold_latch": (latch,)}
    (found,) = records_of(replace(plan, grid=grid)).values()
    chip = Microcontroller.named("8051-12mhz")
    verdict = check_firmware(
        FirmwareCheckPlan(
            image=read_hex(chip.image(Design.C)), design=Design.C, microcontroller=chip, hold_latch=latch == "yes",
            phases=1, tries=50, seed=plan.seed,
        )
    ).to_dict()  # fmt: skip
    failing = [check["name"] for check in verdict["checks"] if not check["passed"]]
    assert found["outcome"] == (f"fails: {', '.join(failing)}" if failing else "right")
    for key in ("reading_us", "worst_insertion_cycles", "max_inserting_hz"):
        assert found[key] == verdict[key]


def test_every_fault_has_a_word_a_place_and_a_category():
    fault = read_plan("safety").kind.parameter("fault")
    assert len(fault.words) == len(VARIANTS)
    of_place = [set(fault.meant(f"place={place}")) for place in ("bus", "pc", "box", "lines")]
    assert sum(map(len, of_place)) == len(set.union(*of_place)) == len(VARIANTS)
    assert set(fault.meant("category=the-lines-before-the-box")) <= of_place[3]
    assert fault.meant("cable-open") == ("encoder-cable-open-for-50-ms", "encoder-cable-open-for-good")


def test_the_built_in_plan_has_the_faults_inside_a_box():
    plan = replace(read_plan("safety").only(["processor-hung", "cutting"]), runs=1)
    assert [job.parameters["design"] for job in plan.jobs()] == [design.value for design in Design]
    own = plan.kind.impossible({**next(plan.jobs()).parameters, "algorithm": "mine.py:Mine#1"})
    assert own is not None


def test_the_lathe_is_that_of_rtec_run():
    study = builtin_study()
    study = replace(study, predictor=TRUTH, model=study.axis_error, designs=(Design.C,), feeds_mm_s=())
    row = next(row for row in run_study(study).rows if row.name == "c")
    usual = {one.name: one.usual[0] for one in LATHE.parameters}
    found = corrected_axis(usual, seed=study.seed, run=5)
    assert (found["result"], found["wanted_steps"]) == ("passed", row.run.wanted_steps)
    assert [found[f"{key}_um"] for key in "AREMB"] == [1000.0 * row.figures.iso[key] for key in "AREMB"]
    assert found["rms_um"] == 1000.0 * row.figures.rms
    coarse = corrected_axis(usual | {"count_um": 4.0}, seed=study.seed, run=5)
    assert coarse["E_um"] > found["E_um"] + 2.0
    warm = corrected_axis(usual | {"thermal_um": 40.0, "warm_up_min": 1.0}, seed=study.seed, run=5)
    assert warm["rms_um"] == pytest.approx(40.0, abs=2.0)  # nearly all readings are taken far behind a minute


def test_a_table_of_a_calibration_knows_as_much_of_the_lathe_as_its_targets_show():
    usual = {one.name: one.usual[0] for one in LATHE.parameters} | {"model": "table", "repeatability_um": 0.0}
    errors = {"offset_um": 15.0, "scale_um_m": 25.0, "pitch_map": 0.5, "backlash": 0.7, "cyclic_phase_deg": 90.0}
    smooth = corrected_axis(usual | errors | {"cyclic": 0.0, "table_spacing_mm": 25.4, "repeats": 1}, seed=1, run=0)
    assert smooth["rms_um"] < 2.0  # two counts of 1 um: an inch is close enough for all but the cyclic error
    cyclic = usual | errors | {"cyclic": 1.0, "repeats": 1}
    wide, close = (corrected_axis(cyclic | {"table_spacing_mm": mm}, seed=1, run=0) for mm in (25.4, 0.635))
    # at whole turns of the screw the table sees one phase; the thesis measured 37 um peak to peak
    assert wide["cyclic_pp_um"] == pytest.approx(0.00145 * 25400.0, rel=0.3)
    assert close["cyclic_pp_um"] < 0.2 * wide["cyclic_pp_um"]


def test_games_are_those_of_the_confusion_matrix():
    line = the_lines()[0]
    score = confusion([line], 2, judged, seed=3).scores[0]
    found = records_of(replace(read_plan("blind").only(["nothing-white-noise"]), runs=2, seed=3))
    for played in score.games:
        record = found["nothing-white-noise", played.trial]
        assert record["result"] == ("passed" if played.right else "failed")
        assert (record["outcome"], record["game_seed"]) == (played.said, str(played.seed))


def test_faults_of_the_open_path_are_counted_by_what_became_of_them():
    plan = read_plan("open-faults").only(
        ["missed-edge", "power-lost", "hold-latch-stuck-open", "phase=0.5", "c", "b"]
    )
    found = list(records_of(replace(plan, runs=1)).values())
    # steady: two faults and two designs at three frequencies; reversal: these and the latch of C
    assert len(found) == 2 * 2 * 3 * 2 + 3
    outcomes = {(record["result"], record["outcome"], record["beyond_supervision"]) for record in found}
    assert ("exempt", "silent corruption", "before the box") in outcomes
    assert {one for one in outcomes if one[0] == "failed"} == set()
    assert all(record["activated_ps"] >= record["moment_ps"] for record in found if record["activated_ps"])
    plan = plan.only(["missed-edge", "c", "motion=steady"])
    second = list(records_of(replace(plan, runs=1, grid={**plan.grid, "second": ("power-lost",)})).values())
    assert all(record["second_activated_ps"] >= record["second_moment_ps"] for record in second)
    # what there is to see of a job is the run that its record is of
    for job in replace(plan, runs=1).jobs():
        record, trace = job.carry_out(), trace_of(plan.kind, job)
        assert trace.marks == ((record["activated_ps"], "missed edge"),)
        assert trace.controller.counts().net == record["controller_counts"]
        assert trace.completed.final == record["corrections_inserted"]
