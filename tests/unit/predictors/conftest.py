import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

from rtec.predictors import _lathe_weights as weights

ORACLE = Path(__file__).resolve().parents[2] / "oracles" / "network_oracle.py"


@pytest.fixture(scope="session")
def oracle() -> ModuleType:
    spec = importlib.util.spec_from_file_location("network_oracle", ORACLE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def paper(oracle: ModuleType) -> str:
    text = oracle.paper_text()
    if text is None:
        pytest.skip("the papers are not beside the project")
    return str(text)


@pytest.fixture(scope="session")
def numbers(oracle: ModuleType) -> dict[str, list[float]]:
    """The printed numbers: from the paper where it is at hand, else from the committed data."""
    text = oracle.paper_text()
    if text is not None:
        return dict(oracle.printed_numbers(text[text.index("/* calcZ.c */") :]))
    return committed_numbers()


def committed_numbers() -> dict[str, list[float]]:
    named = {}
    for prefix, neurons, bias in (
        ("Full", weights.LONG_RANGE, weights.LONG_RANGE_BIAS),
        ("cyclic", weights.CYCLIC, weights.CYCLIC_BIAS),
    ):
        for place, name in enumerate(("IW2", "Bias1", "IW_B1", "LW")):
            named[prefix + name] = [row[place] for row in neurons]
        named[prefix + "Bias2"] = [bias]
    return named


@pytest.fixture(scope="session")
def committed() -> dict[str, list[float]]:
    return committed_numbers()
