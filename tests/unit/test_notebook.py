"""docs/python.ipynb does what it says."""

import json
from pathlib import Path

NOTEBOOK = Path(__file__).parents[2] / "docs" / "python.ipynb"


def test_every_cell_runs_and_shows_what_it_ends_with(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    names = {"__name__": "notebook"}
    shown = []
    for cell in cells:
        if cell["cell_type"] == "code":
            *body, last = "".join(cell["source"]).rstrip().split("\n")
            exec(compile("\n".join(body), "cell", "exec"), names)  # noqa: S102 - our own page
            shown.append(eval(last, names))  # noqa: S307 - the same
    data, unknown, curve, named, parameters = shown
    assert "480 readings" in data._repr_html_()
    assert "<svg" in unknown._repr_html_() and "learned curve over position" in unknown.sentence
    assert curve.axes[0].get_xlabel() == "position (mm)"
    assert "dent" in named._repr_html_()
    assert abs(parameters["place"][0] - 180.0) < 4 * parameters["place"][1]
    assert abs(parameters["dent"][0] - 5.0) < 4 * parameters["dent"][1]
