"""Jobs for the tests of campaigns: importable in other processes; each has the fate that its parameters say."""

import math
import os
import time

from rtec.verify.campaign.job import EXEMPT, FAILED, NOT_ACTIVATED, PASSED, Choice, JobKind, Number
from rtec.verify.campaign.own_files import OwnFile, unpacked

FATES = {"pass": PASSED, "fail": FAILED, "exempt": EXEMPT, "idle": NOT_ACTIVATED}


def ill_fated(parameters, seed, run):
    """Come to the end that ``fate`` says, after ``wait_s``."""
    time.sleep(parameters["wait_s"])
    if parameters["fate"] == "raise":
        raise ValueError("no luck")
    if parameters["fate"] == "die":
        os._exit(1)
    result = FATES[parameters["fate"]]
    return {"result": result, "outcome": f"{result} it did", "value": 1000 * parameters["size_mm"] + seed + run}


KIND = JobKind(
    does="A job meets its fate.",
    function=f"{__name__}:ill_fated",
    parameters=(
        Choice(
            name="fate", words=(*FATES, "raise", "die", "never"), default=("pass",), classes={"end": {"die": "bad"}}
        ),
        Number(name="size_mm", unit="mm", low=0.0, high=10.0, default=1.0),
        Number(name="wait_s", unit="s", low=0.0, high=10.0, default=0.0),
        Number(name="level", low=0, high=100, default=0, whole=True),
    ),
    by=("fate",),
    proves=("fate",),
    impossible=lambda parameters: "it never comes to pass" if parameters["fate"] == "never" else None,
)


def own_text(parameters, seed, run):
    """Return what stands in the folder of an algorithm of one's own, where the job is run."""
    file, name = unpacked(parameters["algorithm"])
    texts = "".join(f"{each.name}: {each.read_text()}" for each in sorted(file.parent.iterdir()))
    return {"result": PASSED, "class": name, "texts": texts, "folder": str(file.parent)}


OWN = JobKind(
    does="An algorithm of one's own is looked at.",
    function=f"{__name__}:own_text",
    parameters=(Choice(name="design", words=("a", "c")), OwnFile(name="algorithm", beside="design")),
    by=("design",),
)


def ishigami(parameters, seed, run):
    """Return the function of Ishigami and Homma (1990), whose Sobol indices are known."""
    x, y, z = (parameters[name] for name in "xyz")
    return {
        "result": PASSED,
        "value": math.sin(x) + 7.0 * math.sin(y) ** 2 + 0.1 * z**4 * math.sin(x),
        "same": 1.0,
        "once": float(run == 3),
    }


ISHIGAMI = JobKind(
    does="A function is evaluated.",
    function=f"{__name__}:ishigami",
    parameters=tuple(Number(name=name, low=-math.pi, high=math.pi, default=0.0) for name in "xyz"),
    by=(),
)
