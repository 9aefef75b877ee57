"""The files of rtec simulate: pictures, and waveform files that are large."""

import pytest
from matplotlib.figure import Figure

VERB = "simulate"
BASE = ["--design", "c", "--frequency", "500kHz", "--cycles", "100", "--corrections", "7"]
SLOW = ["--design", "c", "--frequency", "100kHz", "--cycles", "100", "--corrections", "10"]
MAGIC = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF-"}


@pytest.mark.parametrize("ending", list(MAGIC))
def test_picture_of_each_kind(said, answer, refused, tmp_path, ending):
    file = tmp_path / f"insertion.{ending}"
    assert answer(*BASE, "--figure", file)["figure"] == str(file)
    assert file.read_bytes().startswith(MAGIC[ending])
    assert [path.name for path in tmp_path.iterdir()] == [file.name]
    assert "exists" in refused(*BASE, "--figure", file)
    code, out, _ = said(*BASE, "--figure", file, "--force")
    assert (code, out.splitlines()[-1]) == (0, f"figure: {file}")


def test_state_of_the_insertion_is_chosen(said, tmp_path, monkeypatch):
    titles = []
    monkeypatch.setattr(
        "rtec.report.figures_simulate.waveform", lambda *_, title, **__: titles.append(title) or Figure()
    )
    for levels, state in (("00", 1), ("10", 2), ("11", 3), ("01", 4)):
        words = [*BASE, "--figure", tmp_path / f"{levels}.png", "--figure-state", levels, "--sign", "-"]
        assert said(*words)[0] == 0
        assert titles.pop() == f"Design C, 500 kHz: −2 from state {state} ({levels})"


def test_state_in_which_nothing_begins(said, tmp_path):
    file = tmp_path / "f.png"
    words = [*SLOW, "--figure", file, "--figure-state", "00"]
    code, _, err = said(*words)
    assert (code, file.exists()) == (0, False)
    assert err.startswith(f"rtec: {file} not written: no insertion began in state 00 but in ")
    code, _, err = said(*words, "--home-state", err.split("--home-state ")[1][0])
    assert (code, err, file.exists()) == (0, "", True)


def test_nothing_inserted_nothing_drawn(said, tmp_path):
    file = tmp_path / "f.png"
    code, _, err = said(*SLOW, "--timing", "8051", "--frequency", "200kHz", "--figure", file)
    assert (code, file.exists()) == (1, False)
    assert err == f"rtec: {file} not written: the box has inserted nothing\n"


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--figure", "f.gif"], "--figure: f.gif has another ending; use a name that ends in .png, .svg or .pdf"),
        (["--figure", "no/f.png"], "--figure: there is no folder no for f.png"),
        (["--figure", "f.png", "--figure-state", "12"], "--figure-state: '12' is not valid"),
        (["--figure-state", "10"], "--figure-state needs --figure; use both"),
        (["--figure", "f.png", "--corrections", "0"], "--figure needs --corrections above 0"),
    ],
)
def test_bad_words_are_one_line(refused, tmp_path, monkeypatch, words, says):
    monkeypatch.chdir(tmp_path)
    assert refused(*BASE, *words).startswith(f"rtec: {says}")
    assert list(tmp_path.iterdir()) == []


def test_a_waveform_file_is_not_overwritten_unasked(said, refused, tmp_path):
    file = tmp_path / "wave.vcd"
    file.write_text("mine")
    assert "--force" in refused(*BASE, "--vcd", file)
    assert file.read_text() == "mine"
    assert said(*BASE, "--vcd", file, "--force")[0] == 0
    assert file.read_text().startswith("$version")
    assert [path.name for path in tmp_path.iterdir()] == ["wave.vcd"]


def test_large_file_is_refused_with_its_size(refused, tmp_path):
    err = refused(*BASE, "--cycles", "10000000", "--vcd", tmp_path / "run.vcd")
    assert all(part in err for part in ("about 1.7", "GB long", "GB are free", "--force", "--cycles"))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("agreed", [True, False])
def test_on_a_terminal_the_user_is_asked(said, tmp_path, monkeypatch, agreed):
    asked = []

    class Terminal:
        def isatty(self):
            return True

    monkeypatch.setattr("rtec.cli._seen.sys", type("Sys", (), {"stdin": Terminal(), "stderr": Terminal()}))
    monkeypatch.setattr("rtec.cli._seen.LARGE_BYTES", 1_000)
    monkeypatch.setattr("rtec.cli._seen.typer.confirm", lambda text, err: asked.append((text, err)) or agreed)
    code, _, _ = said(*BASE, "--vcd", tmp_path / "run.vcd")
    assert (code, len(asked)) == (0 if agreed else 2, 1)
    assert (tmp_path / "run.vcd").exists() is agreed
    assert asked[0][0].endswith("GB are free there. Write it?")
    assert asked[0][1] is True


def test_force_writes_it_and_a_pipe_is_not_asked_about(said, refused, tmp_path, monkeypatch):
    monkeypatch.setattr("rtec.cli._seen.LARGE_BYTES", 1_000)
    refused(*BASE, "--vcd", tmp_path / "run.vcd")
    assert said(*BASE, "--vcd", tmp_path / "run.vcd", "--force")[0] == 0
    assert said(*BASE, "--vcd", "/dev/null")[0] == 0
