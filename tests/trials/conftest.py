"""Each trial is a person who has files and follows the README's words; `rtec` is a program of its own."""

import os
import subprocess
import sys

import pytest

from rtec.cli import main


@pytest.fixture
def rtec(tmp_path):
    """Run `rtec` in an empty folder as a person types it; returns the finished process with its text."""

    def run(*words, code=0, **options):
        done = subprocess.run(
            [sys.executable, "-m", "rtec", *words],
            cwd=tmp_path,
            env=os.environ | {"COLUMNS": "80", "NO_COLOR": "1"},
            capture_output=True,
            text=True,
            encoding="utf-8",
            timeout=300,
            check=False,
            **options,
        )
        assert done.returncode == code, done.stdout + done.stderr
        return done

    return run


@pytest.fixture
def typed(tmp_path, monkeypatch, capsys):
    """As `rtec`, for many short commands in a row: they share this process, which has loaded the libraries."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")

    def run(*words, code=0):
        capsys.readouterr()
        found = main(words)
        done = subprocess.CompletedProcess(words, found, *capsys.readouterr())
        assert done.returncode == code, done.stdout + done.stderr
        return done

    return run
