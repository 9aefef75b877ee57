"""The fault tester: a fault in one phase, why it failed, a run of it alone, her CI."""

import json
import re
import shlex

SWAPPED = ("safety", "--fault", "A and B swapped, for 50 ms", "--phase", "at-rest", "--design", "c")
SAID = re.compile(r"A and B swapped, for 50 ms; at rest, design c, run (\d): (.*)")


def runs_told(text):
    """Return what the lines say of each run, by its number; a line of 80 columns goes on in the next."""
    one_line = re.sub(r" *\n(?!A and B|play)", " ", text)
    return {int(number): outcome for number, outcome in SAID.findall(one_line)}


def test_a_part_of_the_safety_case_fails_for_a_reason_and_its_worst_run_is_played_alone(typed):
    """At rest, 00 and 11 are the same with A and B swapped, 10 and 01 are not; four runs rest in all four states."""
    case = json.loads(typed(*SWAPPED, "--seeds", "1", "--json", code=1).stdout)  # as her CI does
    assert (case["good"], case["trials"], case["fired"], case["outcomes"]) == (False, 1, 0, {})
    assert case["reasons"] == [
        "never took effect: A and B swapped, for 50 ms, at rest; more --seeds meet it at other moments"
    ]

    *more, again = typed(*SWAPPED, "--seeds", "4").stdout.splitlines()
    assert max(map(len, more)) <= 80
    told = runs_told("\n".join(more))
    assert len(told) == 2 and all("safe stop" in outcome for outcome in told.values())

    command = shlex.split(again.removeprefix("play it again: "))
    number = int(command[command.index("--first") + 1])
    assert runs_told(typed(*command[1:]).stdout) == {number: told[number]}
