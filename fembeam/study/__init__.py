"""Studies: questions asked of a scene or a model by many runs, each answered by a table and a figure."""

from fembeam.study.mode_count import ModeCount, mode_count

__all__ = ["ModeCount", "mode_count"]
