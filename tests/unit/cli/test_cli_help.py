"""Help: three examples of every verb, each of which the real parser takes, legible at any width."""

import re
import shlex

import pytest
import typer

from rtec.cli import application, main

GROUP = typer.main.get_command(application())
EXAMPLE = "Example: "


def verbs(command=GROUP, words=()):
    """Return every command with the words that call it, groups and all."""
    found = [(words, command)]
    for name, inner in getattr(command, "commands", {}).items():
        found += verbs(inner, (*words, name))
    return found


def parsed(words):
    """Return the command that words call, and what its parser makes of them; nothing is carried out."""
    command, context = GROUP, None
    while True:
        name = words[0] if context else "rtec"
        context = command.make_context(name, list(words[1:] if context else words), parent=context)
        verbs_below = getattr(command, "commands", {})
        if not verbs_below:
            return command, context.params
        # a group has taken its own options; what is left begins with one of its commands
        words = words[next(n for n, word in enumerate(words) if word in verbs_below) :]
        command = verbs_below[words[0]]


every_verb = pytest.mark.parametrize(
    ("words", "command"), [pytest.param(words, command, id=" ".join(words) or "rtec") for words, command in verbs()]
)


@every_verb
def test_three_examples_that_the_parser_takes(words, command):
    examples = [line.removeprefix(EXAMPLE) for line in command.help.splitlines() if line.startswith(EXAMPLE)]
    assert len(examples) == len(set(examples)) == 3
    for example in examples:
        called = []
        for part in example.split(" && "):
            first, *rest = shlex.split(part.rpartition(" | ")[2])
            assert first == "rtec"
            found, values = parsed(rest)
            called.append(found)
            for parameter in found.params:
                listed = (parameter.metavar or "").split("|")
                if len(listed) > 1 and values[parameter.name] is not None and all(map(str.islower, listed)):
                    value = values[parameter.name]
                    given = [getattr(each, "value", each) for each in (value if isinstance(value, list) else [value])]
                    assert all(each in listed for each in given if isinstance(each, str))
        assert not words or getattr(command, "commands", {}) or command in called


def test_an_option_that_is_none_is_noticed():
    with pytest.raises(Exception, match="--frequenzy"):
        parsed(shlex.split("simulate --design c --frequenzy 500kHz"))


@every_verb
@pytest.mark.parametrize("columns", [60, 80])
def test_help_fits_the_terminal(capsys, monkeypatch, words, command, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    assert main([*words, "--help"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= columns
    assert sum(line.strip().startswith("Example: ") for line in lines) == 3
    # no option is cut off
    shown = "\n".join(lines)
    for parameter in command.params:
        for option in parameter.opts:
            assert not option.startswith("--") or option in shown


@pytest.mark.parametrize(
    ("words", "option"),
    [
        (["envelope", "--design", "x"], "--design"),
        (["box", "--design", "x"], "--design"),
        (["run", "--firmware", "--processor", "x"], "--processor"),
        (["check", "c", "--step", "2"], "--step"),
        (["check", "c", "--states", "00"], "--states"),
        (["safety", "--soak", "1e9 h"], "--soak"),
    ],
)
def test_a_message_names_the_option_and_lists_what_is_allowed_once(capsys, words, option):
    assert main(words) == 2
    err = capsys.readouterr().err
    assert re.match(rf"rtec: {option}(:| does not go with) ", err)
    assert err.count("original, a, b, c") <= 1


def test_the_list_of_verbs_says_what_each_of_them_says(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "400")
    main(["--help"])
    listed = [" ".join(line.strip("│").split()) for line in capsys.readouterr().out.splitlines()]
    for name, command in GROUP.commands.items():
        assert f"{name} {command.help.splitlines()[0]}" in listed
