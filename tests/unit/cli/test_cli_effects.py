"""rtec effects: the library as a table, a card, and a document."""

import json

import pytest

from rtec.effects import LIBRARY, effect_named

VERB = "effects"

CONTRACT = (
    "offset scale pitch_map cyclic backlash backlash_map windup reversal_spike hysteresis "
    "thermal_growth thermal_shift warm_up warm_up_growth run_offset refraction dead_path drift servo_lag "
    "acceleration_lag interpolation eccentricity lost_counts quantisation cosine inertia viscous coulomb "
    "asymmetric_friction stribeck force_offset cogging gravity force_map load_friction screw_runout torque_ripple"
).split()


def test_every_effect_stands_in_the_table(said, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    code, out, err = said()
    assert (code, err) == (0, "")
    for name in CONTRACT:
        assert any(line.split()[:1] == [name] for line in out.splitlines()), name
    assert max(map(len, out.splitlines())) <= 80


def test_the_document_holds_every_card(said):
    code, out, err = said("--json")
    assert (code, err, out.count("\n")) == (0, "", 1)
    found = {entry["name"]: entry for entry in json.loads(out)["effects"]}
    assert list(found) == CONTRACT
    for name, entry in found.items():
        card = effect_named(name).card
        assert (entry["title"], entry["cause"], entry["action"]) == (card.title, card.cause, card.action)
        assert entry["needs"] == effect_named(name).needs
        assert {rival["name"] for rival in entry["look_alikes"]} <= set(CONTRACT)
        assert entry["parameters"]
    assert {name: entry["at_most"] for name, entry in found.items() if entry["at_most"] > 1} == {
        "thermal_growth": 3, "thermal_shift": 3, "lost_counts": 3, "cyclic": 3, "cogging": 4,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("backlash", [("backlash", "um")]),
        ("pitch_map", [("nodes", "mm"), ("at_...", "um")]),
        ("stribeck", [("distance", "mm"), ("carried", ""), ("speed", "mm/s"), ("stribeck", "N")]),
    ],
)
def test_parameters_have_names_and_units(said, name, parameters):
    _, out, _ = said(name, "--json")
    document = json.loads(out)
    assert [(entry["name"], entry["unit"]) for entry in document["parameters"]] == parameters


@pytest.mark.parametrize("effect", LIBRARY, ids=lambda effect: effect.name)
def test_a_card_says_all_that_is_known(said, monkeypatch, effect):
    monkeypatch.setenv("COLUMNS", "500")
    code, out, err = said(effect.name)
    assert (code, err) == (0, "")
    text = " ".join(out.split())
    for words in (effect.card.title, effect.card.plot, effect.card.cause, effect.card.action, effect.card.source):
        assert words in text
    for rival in effect.rivals:
        ever = " (with any plan of the same instrument)" if rival.permanent else ""
        assert f"confounded with {rival.name}{ever}; to separate them: {rival.experiment}" in text


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("backlsh", "did you mean 'backlash'?"),
        ("jitter", "captures"),
        ("zzz", "known: offset"),
        ("x" * 10_000, "is not an effect"),
        ("[red]", "[red]"),
    ],
)
def test_other_names_are_one_line_and_2(said, name, says):
    code, out, err = said(name)
    assert (code, out) == (2, "")
    assert says in err
    assert err.count("\n") == 1
    assert len(err) < 600
