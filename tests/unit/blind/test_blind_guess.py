"""A player's answer against the seal."""

import pytest

from rtec.blind.guess import guessed, points_of, read_answer, total_of
from rtec.blind.hidden import Hidden, Parameter, Secret
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
        (["zzz"], "'zzz' is not an effect"),
        (["drift", "drift"], "each name once"),
        (["nothing", "drift"], "'nothing' alone"),
    ],
)
def test_an_answer_that_is_none_is_refused(answer, says):
    with pytest.raises(ArgumentError, match=says):
        guessed(secret("drift"), answer)


def played(value, *others, outside=()):
    """Return a secret with a play of that size, and others without a size."""
    play = Hidden(
        name="backlash", description="", parameters=(Parameter("play", value, "um", scales=True),), rms_sigma=3.0
    )
    more = tuple(Hidden(name=name, description="", parameters=(), rms_sigma=3.0) for name in others)
    return Secret(effects=(play, *more), noise="white", sigma_um=2.0, seed=1, plan="base", outside=outside)


@pytest.mark.parametrize(
    ("answer", "points", "why"),
    [
        ("backlash", 2, "its size is not said"),
        ("backlash=10 um", 3, "the size is 0 % off, within 10 %"),
        ("backlash=-11 um", 3, "the size is 10 % off, within 10 %"),  # the library's has the other sign
        ("backlash=100 um", 2, "the size is 900 % off, more than 10 %"),
        ("backlash=\N{MINUS SIGN}12.00 ± 2.10 µm", 3, "within the uncertainty"),  # as a diagnosis shows it
        ("backlash=11.1 um", 2, "the size is 11 % off, more than 10 %"),
        ("backlash=12 +- 2 um", 3, "20 % off, within the uncertainty that is stated"),
        ("backlash=12 +- 1 um", 2, "20 % off, more than 10 %"),
        ("backlash=20 +- 10 um", 2, "100 % off, more than 10 %, and its uncertainty is wider than 25 %"),
        ("backlash=10 +- 9 um", 3, "0 % off, within 10 %"),
    ],
)
def test_points_for_a_size(answer, points, why):
    (one,) = points_of(played(-10.0), read_answer([answer]))
    assert (one.points, one.most) == (points, 3)
    assert why in one.why


@pytest.mark.parametrize(
    ("answer", "total"),
    [
        (["backlash=10 um", "moving_bump"], (5, 5)),
        (["backlash=10 um", "unknown"], (5, 5)),
        (["backlash=10 um"], (3, 5)),
        (["backlash=10 um", "drift", "cyclic=3 um"], (1, 5)),
        (["drift", "cyclic", "scale"], (0, 5)),
        (["nothing"], (0, 5)),
        (["backlash", "offset"], (2, 5)),
    ],
)
def test_the_sum_of_points(answer, total):
    strange = played(10.0, "moving_bump", outside=("moving_bump",))
    assert total_of(points_of(strange, read_answer(answer))) == total


def test_nothing_is_worth_two_points():
    assert total_of(points_of(secret(), read_answer(["nothing"]))) == (2, 2)
    assert total_of(points_of(secret(), read_answer(["drift"]))) == (0, 2)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["backlash=3"], "EFFECT: 'backlash=3' is not valid"),
        (["backlash=3 UM"], "did you mean '3 um'"),
        (["unknown=3 um"], "unknown without a value"),
        ([], "no name"),
    ],
)
def test_words_that_are_no_answer_are_refused(words, says):
    with pytest.raises(ArgumentError, match=says):
        read_answer(words)
