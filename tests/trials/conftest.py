"""Each trial is a person who brings what they have and follows the README's words, with `rtec` as a program of its own."""

import os
import subprocess
import sys

import pytest


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
            **options,
        )
        assert done.returncode == code, done.stdout + done.stderr
        return done

    return run
