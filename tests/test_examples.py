"""Every example runs in its own process; its asserted numbers hold."""

import os
from pathlib import Path

import fresh_process
import pytest

from fembeam import scene_file

FOLDER = Path(__file__).parent.parent / "examples"


@pytest.mark.example
@pytest.mark.chaotic
@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.name)
def test_example(path, tmp_path):
    quick = ["--quick"] if "--quick" in path.read_text(encoding="utf-8") else []
    launcher = [str(FOLDER.parent / "tests" / "realisation.py")] if "FEMBEAM_REALISATION" in os.environ else []
    fresh_process.run_script(tmp_path, *launcher, str(path), *quick)


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.toml")), ids=lambda path: path.name)
def test_scene_file(path):
    assert scene_file.read(path).studies
