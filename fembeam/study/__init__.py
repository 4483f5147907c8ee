"""Studies: questions asked of a scene or a model by many runs, each answered by a table and a figure."""

from fembeam.study.mode_count import ModeCount, mode_count
from fembeam.study.smallest_model import NotMetError, SmallestModel, smallest_model

__all__ = ["ModeCount", "NotMetError", "SmallestModel", "mode_count", "smallest_model"]
