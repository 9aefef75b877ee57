"""The shell's completion: of the words that exist, and without loading what computes."""

import os
import subprocess
import sys

import can
import pytest
import typer

from rtec.axis.motion import NAMES
from rtec.blind.plan import PLANS
from rtec.board import MICROCONTROLLERS
from rtec.cli import application
from rtec.effects import LIBRARY
from rtec.effects.library import OF_LOOP
from rtec.training import all_methods
from rtec.training.dynamic_methods import dynamic_methods
from rtec.training.dynamic_results import DynamicKind
from rtec.training.warm_methods import warm_methods
from rtec.training.warm_results import WarmKind
from rtec.verify.safety.phases import Phase, hyphened
from rtec.verify.safety.variants import VARIANTS

GROUP = typer.main.get_command(application())


def offered(verb, name):
    """Return what the shell is offered for a parameter of a verb."""
    command = GROUP
    for word in verb.split():
        command = command.commands[word]
    parameter = next(one for one in command.params if one.name == name)
    return [item.value for item in parameter.shell_complete(typer.Context(GROUP), "")]


WARM = [one for one in warm_methods() if one.kind is not WarmKind.NONE]
MOTION = [one for one in dynamic_methods() if one.kind is not DynamicKind.NONE]


@pytest.mark.parametrize(
    ("verb", "name", "real"),
    [
        ("effects", "name", [effect.name for effect in (*LIBRARY, *OF_LOOP)]),
        ("run", "processor", list(MICROCONTROLLERS)),
        ("blind new", "plan", list(PLANS)),
        (
            "train",
            "pick",
            [one.name.replace(" ", "-") for one in (*all_methods(several_axes=True)[1:], *MOTION, *WARM)],
        ),
        ("safety", "fault", list(dict.fromkeys(hyphened(one.name.split(",")[0]) for one in VARIANTS))),
        ("safety", "phase", [hyphened(phase.value) for phase in Phase]),
        ("simulate", "motion", list(NAMES)),
    ],
)
def test_the_words_are_those_of_the_program(verb, name, real):
    assert offered(verb, name) == real


def test_interfaces_are_those_of_python_can():
    assert set(offered("box", "interface")) <= set(can.VALID_INTERFACES)


def completed(folder, line):
    """Return what the shell is offered behind ``line``, and the modules that were loaded for it."""
    script = (
        "import sys; from rtec.cli import main\n"
        "try: main([])\n"
        "finally: print([m for m in ('numba', 'numpy', 'pint', 'matplotlib', 'can') if m in sys.modules],"
        " file=sys.stderr)\n"
    )
    words = line.split(" ")
    env = os.environ | {
        "_RTEC_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": str(len(words) - 1),
        "PYTHONPATH": os.pathsep.join(sys.path),
    }  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, env=env, cwd=folder, check=True
    )
    return done.stdout.split(), done.stderr.strip()


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("rtec simulate --design ", ["original", "a", "b", "c"]),
        ("rtec simulate --timing f", ["fast", "firmware"]),
        ("rtec add backlash_", ["backlash_map"]),
        ("rtec docs tutorial", ["tutorial", "tutorial-diagnosis"]),
        ("rtec check m", ["mine.ihx", "mine.py"]),
        ("rtec firmware run ", ["images/", "mine.ihx"]),
        ("rtec firmware run images/", ["images/c.hex"]),
    ],
)
def test_what_the_shell_is_offered(tmp_path, line, expected):
    (tmp_path / "images").mkdir()
    for name in ("mine.ihx", "mine.py", "mine.txt", ".hidden.hex", "images/c.hex"):
        (tmp_path / name).touch()
    assert completed(tmp_path, line) == (expected, "[]")


def parameters(command, words=()):
    """Yield every parameter of every verb with the words that call it."""
    verbs = getattr(command, "commands", {})
    for name, inner in verbs.items():
        yield from parameters(inner, (*words, name))
    if not verbs:
        yield from ((words, parameter) for parameter in command.params)


def test_what_lists_its_values_completes_them_and_lists_them_once():
    checked = 0
    for words, parameter in parameters(GROUP):
        listed = (parameter.metavar or "").split("|")
        if len(listed) == 1 or not all(part.lower() == part and "'" not in part for part in listed):
            continue
        found = [item.value for item in parameter.shell_complete(typer.Context(GROUP), "")]
        assert found == listed, (words, parameter.name)
        assert not all(part in (parameter.help or "") for part in listed), (words, parameter.name)
        checked += 1
    assert checked > 20
