"""Where machine code is kept."""

import os
import tempfile
from pathlib import Path

from rtec import _jit


def test_a_user_without_a_home_gets_a_temporary_folder(monkeypatch, tmp_path):
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(os.path, "expanduser", lambda path: path)  # what it does where nobody knows the home
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert _jit._cache_folder().parent == tmp_path
    assert not Path("~").exists()
