"""Scenes as users build them, every number against a second implementation; `bench/random_models.py` does hundreds."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent / "bench"))

from random_models import judge

SCENES = [(3, 0), (4, 1), (9, 2), (3, 3)]  # with every kind of support, load and body


@pytest.mark.parametrize(("seed", "depth"), SCENES)
def test_every_number_of_a_scene_is_that_of_a_second_implementation(seed, depth):
    """Its bounds are derived in `random_models`; the motion is short, so that it is determined by its start."""
    words, wrong, _ = judge(seed, depth, part=0.3)
    assert not wrong, words
