"""The documentation: files that exist, links that lead somewhere, commands that do what the pages show."""

import json
import math
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import typer
from PIL import Image

import rtec.report.folder
import rtec.study
from rtec.cli import application, main
from rtec.metrology import ExperimentPlan, Reading
from rtec.metrology.experiment_file import KEYS, experiment_lines
from rtec.report.diagnosis import diagnosis_document
from rtec.report.document import row_dict, study_document
from rtec.study import builtin_study, builtin_text, run_study
from tests.consoles import FENCE, carried_out, differences, files_of, steps_of, unfounded

ROOT = Path(__file__).parents[2]
PAGES = sorted([ROOT / "README.md", ROOT / "CHANGELOG.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")])
TUTORIAL, OF_THE_DIAGNOSIS, README = (
    ROOT / "docs/tutorial.md",
    ROOT / "docs/tutorial-diagnosis.md",
    ROOT / "README.md",
)
COMMANDS = typer.main.get_command(application()).commands


def identity(page):
    return page.relative_to(ROOT).as_posix()


def text_of(page):
    return page.read_text(encoding="utf-8")


def blocks(page, kind):
    return [match["body"] for match in FENCE.finditer(text_of(page)) if match["kind"] == kind]


def anchors(page):
    heads = re.findall(r"^#+ (.*)$", FENCE.sub("", text_of(page)), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


def code_spans(page):
    return re.findall(r"`([^`\n]+)`", FENCE.sub("", text_of(page)))


# names and links


@pytest.mark.parametrize("page", PAGES, ids=identity)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)\s]+)\)", FENCE.sub("", text_of(page))):
        if target.startswith("http"):
            continue
        path, _, anchor = target.partition("#")
        place = (page.parent / path).resolve() if path else page
        assert place.exists(), f"{identity(page)}: {target}"
        if anchor:
            assert anchor in anchors(place), f"{identity(page)}: {target}"


@pytest.mark.parametrize("page", PAGES, ids=identity)
def test_paths_exist(page):
    for span in code_spans(page):
        if re.fullmatch(r"(?:rtec|tests|benchmarks|tools|docs|\.ci)/[\w./*-]*", span) and "*" not in span:
            assert (ROOT / span).exists(), f"{identity(page)}: {span}"


def test_rooms_are_those_of_the_package():
    rooms = set(re.findall(r"^\| `rtec/(\w+)` \|", text_of(ROOT / "docs" / "architecture.md"), re.MULTILINE))
    assert rooms == {path.parent.name for path in (ROOT / "rtec").glob("*/__init__.py")}


# commands


def test_readme_opens_with_the_two_commands():
    lines = text_of(README).splitlines()
    assert lines[:4] == [
        "# rtec",
        "",
        "    python -m pip install .            && rtec run",
        '    python -m pip install ".[test]"    && pytest',
    ]
    assert (ROOT / "docs" / "lathe.png").stat().st_size < 200_000


@pytest.mark.parametrize("page", PAGES, ids=identity)
def test_options_of_the_commands_shown_exist(page):
    for line in re.findall(r"^(?:    |\$ )rtec (.+)$", text_of(page), re.MULTILINE):
        command, *words = line.split()
        parser = COMMANDS[command]
        if words and words[0] in getattr(parser, "commands", {}):
            parser = parser.commands[words[0]]
        known = {option for parameter in parser.params for option in parameter.opts} | {"--help"}
        assert set(re.findall(r"\s(--[a-z-]+)", line.partition(" && ")[0])) <= known, f"{identity(page)}: {line}"


@pytest.fixture(scope="module")
def quiet_run():
    return run_study(replace(builtin_study(), repeatability_mm=0.0, feeds_mm_s=()))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return where the commands of the tutorial were carried out."""
    return tmp_path_factory.mktemp("tutorial")


@pytest.fixture(scope="module")
def printed(quiet_run, folder, tmp_path_factory):
    """Return the commands of the tutorial and the README with what each prints, `rtec run` once and without pictures.

    What the tutorial of the diagnosis shows as well is held by the test that runs that.
    """
    held = {tuple(step.words) for step in steps_of(text_of(OF_THE_DIAGNOSIS))}
    of_the_readme = tmp_path_factory.mktemp("readme")
    (of_the_readme / "before-after").symlink_to(folder / "before-after")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("COLUMNS", "100")
        patch.setattr(rtec.study, "run_study", lambda *_, **__: quiet_run)
        for name in ("illustrations", "search_figures"):
            patch.setattr(rtec.report.folder, name, lambda *_: ())
        done = {}
        for page, where in ((TUTORIAL, folder), (README, of_the_readme)):
            patch.chdir(where)
            done[page] = carried_out(text_of(page), but=held)
        return done


@pytest.mark.parametrize("page", [README, TUTORIAL], ids=identity)
def test_consoles_show_what_the_commands_print(page, printed):
    assert differences(printed[page]) == [], f"python -m tests.consoles {identity(page)} writes them anew"
    assert sum(len(step.shown) for step, _ in printed[page]) > 20


@pytest.mark.parametrize("page", [README, TUTORIAL, OF_THE_DIAGNOSIS], ids=identity)
def test_numbers_of_the_prose_stand_in_the_console_beside_it(page):
    assert unfounded(text_of(page)) == []


def test_tutorial_study_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in files_of(text_of(TUTORIAL)).items():
        Path(name).write_text(text, encoding="utf-8")
    study = rtec.study.read_study(Path("my.toml"))
    assert study.name == "mine"
    # 4 lines of the table; at 500 mm the reverse curve lies 8 um above the forward one
    forward, reverse = (float(study.model.error_mm(500.0, way)) for way in (1, -1))
    assert (round(forward, 6), round(reverse - forward, 6)) == (0.011, 0.008)


def readme_tables():
    """Return the rows of the README's two tables: the staircase, and what each design leaves."""
    lines = text_of(README).split("## What each design leaves")[1].split("\n## ")[0].splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    return [row for row in cells if len(row) == 3][2:], [row for row in cells if len(row) == 6][2:]


def test_readme_table_is_what_the_command_measures(quiet_run):
    stairs, table = readme_tables()
    training = [quiet_run.learned.diagnosis.rms_before, *(s.rms_train for s in quiet_run.learned.diagnosis.steps)]
    truth = [score.rms_mm for score in quiet_run.learned.scores]
    for figures, column in ((training, 1), (truth, 2)):
        assert [row[column] for row in stairs] == [f"{mm * 1000:#.3g}" for mm in figures]
    assert len(table) == len(quiet_run.rows) == 6
    for cells, row in zip(table, quiet_run.rows, strict=True):
        measured = row_dict(row)
        keys = ("max_average_error_um", "max_reversal_error_um", "pp_um", "rms_um")
        assert [float(cell) for cell in cells[1:5]] == [round(measured[key], 1) for key in keys], cells[0]
        assert int(cells[5].replace(" ", "") or 0) == measured["corrections_inserted"]


def test_readme_picture_shows_the_figures_of_its_table():
    with Image.open(ROOT / "docs" / "lathe.png") as picture:
        panels = picture.text["Description"].splitlines()
    shown = [re.findall(r"\b[EB] ([\d.]+)", panel) for panel in panels]
    assert shown == [row[1:3] for row in readme_tables()[1]], "python tools/readme_picture.py draws it anew"


# reference


def test_study_keys_are_those_of_the_builtin_study():
    builtin = tomllib.loads(builtin_text())
    keys = {key for key, value in builtin.items() if not isinstance(value, dict)}
    keys |= {f"{name}.{key}" for name, table in builtin.items() if isinstance(table, dict) for key in table}
    page = text_of(ROOT / "docs" / "reference.md").split("## Study file")[1].split("\n## ")[0]
    rows = re.findall(r"^\| `([a-z_.]+)` \| (.*?) \|", page, re.MULTILINE)
    named = dict(rows)
    assert set(named) == keys | {"axis.jerk"}  # which the built-in study leaves out
    for key, shown in named.items():
        name, _, rest = key.partition(".")
        value = builtin[name] if not rest else builtin[name].get(rest)
        if isinstance(value, str | int | float) and key != "title":  # in words on the page
            said = str(value).lower() if isinstance(value, bool) else str(value)  # as TOML has it
            assert shown.strip("`") == said, key


def keys_of(document, under=("params", "not_testable", "minimum_detectable", "probability", "lack_of_fit", "final")):
    """Return every key of a document, but not those that are names of effects and parameters."""
    if isinstance(document, list):
        return set().union(*(keys_of(item) for item in document))
    if not isinstance(document, dict):
        return set()
    return set(document).union(*(keys_of(value) for key, value in document.items() if key not in under))


@pytest.fixture(scope="module")
def json_keys():
    page = text_of(ROOT / "docs" / "reference.md").split("## JSON")[1].split("\n## ")[0]
    parts = re.split(r"\*\*`rtec ([\w .-]+) --json`\*\*", page)[1:]
    return {
        verb: set(re.findall(r"`([A-Za-z_]\w*)`", part)) for verb, part in zip(parts[::2], parts[1::2], strict=True)
    }


@pytest.mark.usefixtures("printed")
def test_json_keys_are_those_of_the_commands(quiet_run, capsys, folder, json_keys):
    rows = row_dict(quiet_run.rows[0])
    names = {row.name for row in quiet_run.rows}
    document = study_document(quiet_run)
    found = (
        set(document)
        | set(document["model"])
        | set(document["rounds"][0])
        | {"report"}
        | set(rows)
        | set(rows["iso230"])
        | names
    )
    found |= {"fault", "times"}  # of a row to which something happens
    # of a machine that warms over a shift (tests/unit/study/test_study_heat.py)
    found |= {"cold", "warm", "speed", "worst_um", "calibrations", "time_s", "mean_um", "outside_s", "outside_input"}
    assert json_keys["run"] - {"learned"} == found
    assert document["diagnosis"] == diagnosis_document(quiet_run.learned.diagnosis)
    main(["simulate", "--design", "c", "--frequency", "10kHz", "--cycles", "9", "--corrections", "1", "--json"])
    assert json_keys["simulate"] == set(json.loads(capsys.readouterr().out))
    main(["iso230", str(folder / "before-after" / "readings" / "b.csv"), "--json"])
    document = json.loads(capsys.readouterr().out)
    found = set(document)
    more = {"report", "files", "name", *document["vdi3441"], *document["uncertainty"]}  # a report, several files
    assert json_keys["iso230"] - {"_forward", "_backward"} - more == {
        key for key in found if not key.endswith(("_forward", "_backward"))
    }
    assert {key for key in more if not key.endswith(("_forward", "_backward"))} <= json_keys["iso230"]
    assert {key for key in found if key.endswith("_forward")} == {
        f"{k}_forward" for k in ("A", "R", "E", "cyclic_pp")
    }


def bumpy_axis(moving_bump_um):
    """A measurement with backlash and a bump that moves from run to run, which no effect of the library is."""
    noise = np.random.default_rng(3)
    places = [20.0 * k + noise.uniform(-3, 3) for k in range(21)]
    lines = ["run,direction,target_mm,deviation_um"]
    for run in range(1, 6):
        for way in (1, -1):
            for x in places[::way]:
                bump = moving_bump_um * math.exp(-(((x - 60.0 * run) / 25.0) ** 2))
                lines.append(f"{run},{way},{x:.4f},{5.0 * way + bump + noise.normal():.4f}")
    return "\n".join(lines) + "\n"


def test_json_keys_of_the_understanding_loop(json_keys, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    *lines, last = bumpy_axis(12.0).splitlines()
    Path("z.csv").write_text(bumpy_axis(0.0))
    Path("bump.csv").write_text("\n".join([*lines, last.rpartition(",")[0] + ",500.0"]) + "\n")

    def printed(*words):
        main([*words, "--json"])
        return keys_of(json.loads(capsys.readouterr().out))

    added = printed("add", "backlash", "z.csv", "-o", "b.toml")
    assert json_keys["compare"] == printed("compare", "z.csv", "--model", "b.toml") | {"report"}
    written = {"report", "model", "plan"}  # where they were asked for; tests of these commands ask
    found = printed("diagnose", "z.csv", "--next", "1h") | written
    # what only some answers hold: an unknown structure, and readings that were left out
    sometimes = {"depends_on", "period", "period_unit", "frequency_hz", "description", "row", "deviation"}
    sometimes |= {"nats", "csv", "gcode"}  # of the next hour, where something is tied, and where it is written
    curve = {
        "over",
        "across",
        "by_direction",
        "rms",
        "descriptions",
        "values",
        "errors",
        "at",
        "at_across",
        "directions",
    }
    assert json_keys["diagnose"] - sometimes - curve <= found <= json_keys["diagnose"]
    assert json_keys["diagnose"] == found | printed("diagnose", "bump.csv") | curve | sometimes
    assert added <= json_keys["diagnose"]
    assert json_keys["effects"] == printed("effects")
    assert json_keys["blind new"] == printed("blind", "new", "--seed", "7", "-o", "data.csv")
    assert json_keys["blind reveal"] == printed("blind", "reveal", "data.csv")
    Path("plan.toml").write_text("[runs]\nnumber = 2\n")
    again = printed("blind", "measure", "data.csv", "--plan", "plan.toml", "-o", "second.csv")
    assert json_keys["blind measure"] == again
    assert json_keys["blind guess"] == printed("blind", "guess", "data.csv", "nothing")


def test_json_keys_of_models_of_motion(json_keys, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    rows = [f"{1e-3 * k:.3f},{math.sin(0.02 * k):.6f},{math.sin(0.02 * k - 0.1):.6f}" for k in range(200)]
    Path("log.csv").write_text("\n".join(["time_s,command_mm,actual_mm", *rows]) + "\n")
    words = ["train", "--dynamic", "log.csv", "--budget", "1 ms", "--starts", "1", "-o", "m.toml", "--pick", "ARX"]
    main([*words, "--json"])
    document = json.loads(capsys.readouterr().out)
    kinds = {row["kind"] for row in document["rows"]}
    assert json_keys["train --dynamic"] == keys_of(document) | kinds
    main(["compare", "log.csv", "--model", "m.toml", "--json"])
    assert json_keys["compare --model MOTION.toml"] == set(json.loads(capsys.readouterr().out))


def test_the_keys_of_an_experiment_plan_are_those_of_the_page():
    page = text_of(ROOT / "docs" / "reference.md").split("## Experiment plans")[1].split("\n## ")[0]
    rows = [line.split("|")[1:3] for line in page.splitlines() if line.startswith("| `")]
    keys = [re.findall(r"`([\w.]+)`", row[0]) for row in rows]
    assert sorted(key for of_row in keys for key in of_row) == sorted(KEYS.values())
    at_rest, moving = (
        tomllib.loads("\n".join(experiment_lines(ExperimentPlan(reading=reading))))
        for reading in (Reading.AT_REST, Reading.MOVING)
    )
    usual = at_rest | {"runs": moving["runs"] | at_rest["runs"]}
    for of_row, (_, shown) in zip(keys, rows, strict=True):
        values = [usual[key] if "." not in key else usual[key.split(".")[0]].get(key.split(".")[1]) for key in of_row]
        written = ", ".join(json.dumps(value) for value in values)
        assert shown.strip() == ("(none)" if values == [None] else written), of_row


def test_json_keys_of_the_score(json_keys, tmp_path, monkeypatch, capsys):
    from rtec.blind import lines as module

    monkeypatch.chdir(tmp_path)
    lines = module.the_lines()[:1]
    monkeypatch.setattr(module, "the_lines", lambda: lines)
    main(["blind", "score", "--trials", "1", "-o", "score.md", "--json"])
    assert json_keys["blind score"] == keys_of(json.loads(capsys.readouterr().out))


def test_json_keys_of_a_campaign(json_keys, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = ("motions", "--only", "c,fast,dither,frequency=500kHz", "--runs", "1", "--workers", "1", "--json")
    assert main(["campaign", *words]) == 0
    document = json.loads(capsys.readouterr().out)
    document["total"].pop("outcomes")
    (row,) = document["rows"]
    assert row.pop("outcomes") == {"correct": 1}
    of_jobs = {"job", "requirement", "run", "error", "report"}  # none has failed, and nothing is written
    of_coverage = {"dimensions", "possible", "hit", "left_out"}  # this plan observes nothing beside its parameters
    assert json_keys["campaign"] - of_jobs - of_coverage == keys_of(document) - set(document["by"]) | {"outcomes"}


def test_json_keys_of_the_firmware(json_keys, tmp_path, capsys):
    path = tmp_path / "image.hex"
    path.write_text(":01000000A55A\n:00000001FF\n")
    for verb in ("run", "disassemble"):
        assert main(["firmware", verb, str(path), "--json"]) == 0
        found = keys_of(json.loads(capsys.readouterr().out))
        # values of the keys, no keys
        assert json_keys[f"firmware {verb}"] - {"budget", "power-down"} == found


def test_models_of_the_pages_are_read(tmp_path):
    from rtec.effects import Units
    from rtec.inference.model_file import read_model

    read = 0
    for page in (ROOT / "docs" / "reference.md", ROOT / "docs" / "how-to.md"):
        for block in re.findall(r"(?:^    .*\n|^\n)+", text_of(page), re.MULTILINE):
            if block.strip().startswith("observe = "):
                (tmp_path / "m.toml").write_text(re.sub(r"^    ", "", block, flags=re.MULTILINE))
                assert len(read_model(tmp_path / "m.toml", Units("mm", "mm", "s")).terms) == 2
                read += 1
    assert read == 2


def test_verdicts_are_those_of_the_search():
    from rtec.inference.results import Verdict

    rows = re.findall(r"^\| `([A-Z_]+)` \|", text_of(ROOT / "docs" / "reference.md"), re.MULTILINE)
    assert set(rows) == {verdict.value for verdict in Verdict}


def test_python_of_the_readme_runs():
    for code in blocks(README, "python"):
        exec(compile(code, "README.md", "exec"), {})  # noqa: S102 - our own page


def test_python_of_the_live_page_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)  # it writes a log
    for code in blocks(ROOT / "docs" / "how-to-live.md", "python"):
        exec(compile(code, "how-to-live.md", "exec"), {})  # noqa: S102 - our own page
    assert "Request 1 RIGHT" in capsys.readouterr().out


def test_python_of_the_how_to_parses_and_the_closed_loop_runs(capsys):
    codes = blocks(ROOT / "docs" / "how-to.md", "python")
    for code in codes:
        compile(code, "how-to.md", "exec")
    exec(next(code for code in codes if "run_machine" in code), {})  # noqa: S102 - our own page
    assert capsys.readouterr().out.startswith("True ")
