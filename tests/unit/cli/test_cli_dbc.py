"""A DBC of the user's, before anything is opened."""

from importlib.resources import files

import pytest

from rtec.cli import main


@pytest.mark.parametrize("verb", ["box", "pc"])
def test_another_dbc_is_refused_by_its_first_difference(verb, tmp_path, capsys):
    ours = files("rtec.link").joinpath("rtec.dbc").read_text(encoding="utf-8")
    theirs = tmp_path / "theirs.dbc"
    theirs.write_text(ours.replace("SG_ Total : 16|16@1-", "SG_ Total : 16|15@1-"), encoding="utf-8")
    assert main([verb, "--dbc", str(theirs)]) == 2
    _, err = capsys.readouterr()
    assert len(err.splitlines()) == 1
    assert "theirs.dbc" in err and "Request_1" in err and "Total" in err and "15" in err
