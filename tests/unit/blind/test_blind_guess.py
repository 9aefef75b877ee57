"""A player's answer against the seal."""

import pytest

from rtec.blind import Secret, guessed
from rtec.blind.hidden import Hidden
from rtec.errors import ArgumentError


def secret(*names, noise="white", outside=()):
    effects = tuple(Hidden(name=name, description="", parameters=(), rms_sigma=3.0) for name in names)
    return Secret(effects=effects, noise=noise, sigma_um=2.0, seed=1, plan="base", outside=outside)


@pytest.mark.parametrize(
    ("hidden", "answer", "right", "missed", "wrong"),
    [
        (("backlash", "drift"), ("drift", "backlash"), ("drift", "backlash"), (), ()),
        (("backlash", "drift"), ("cyclic",), (), ("backlash", "drift"), ("cyclic",)),
        (("backlash",), ("backlash", "scale"), ("backlash",), (), ("scale",)),
        (("backlash",), ("nothing",), (), ("backlash",), ()),
        ((), ("nothing",), (), (), ()),
        ((), ("drift",), (), (), ("drift",)),
        ((), ("unknown",), (), (), ("unknown",)),
        (("drift",), ("offset", "drift"), ("drift",), (), ()),
    ],
)
def test_what_was_right_missed_and_wrong(hidden, answer, right, missed, wrong):
    found = guessed(secret(*hidden), answer)
    assert (found.right, found.missed, found.wrong) == (right, missed, wrong)
    assert found.solved is (not missed and not wrong)


def test_what_lies_outside_the_library_is_unknown_or_its_own_name():
    strange = secret("moving_bump", outside=("moving_bump",))
    assert guessed(strange, ["unknown"]).solved
    assert guessed(strange, ["moving_bump"]).solved
    assert guessed(strange, ["pitch_map"]).missed == ("moving_bump",)


def test_offsets_of_runs_are_no_mistake_where_they_are_the_noise():
    assert guessed(secret("drift", noise="offsets per run"), ["drift", "run_offset"]).solved
    assert not guessed(secret("drift"), ["drift", "run_offset"]).solved


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        ([], "no name"),
        (["driftt"], "did you mean 'drift'"),
        (["zzz"], "'zzz' is not allowed"),
        (["drift", "drift"], "each name once"),
        (["nothing", "drift"], "'nothing' alone"),
    ],
)
def test_an_answer_that_is_none_is_refused(answer, says):
    with pytest.raises(ArgumentError, match=says):
        guessed(secret("drift"), answer)
