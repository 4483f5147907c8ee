"""Every example runs in its own process; its asserted numbers hold."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from fembeam import scene_file

FOLDER = Path(__file__).parent.parent / "examples"


@pytest.mark.example
@pytest.mark.chaotic
@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.name)
def test_example(path, tmp_path):
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    quick = ["--quick"] if "--quick" in path.read_text(encoding="utf-8") else []
    launcher = [str(FOLDER.parent / "tests" / "realisation.py")] if "FEMBEAM_REALISATION" in os.environ else []
    command = [sys.executable, *launcher, str(path), *quick]
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.toml")), ids=lambda path: path.name)
def test_scene_file(path):
    assert scene_file.read(path).studies
