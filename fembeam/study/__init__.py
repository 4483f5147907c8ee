"""Studies: questions asked of a scene or a model by many runs, each answered by a table and a figure."""

from fembeam.study.ensemble import Ensemble, ensemble
from fembeam.study.mode_count import ModeCount, mode_count
from fembeam.study.smallest_model import NotMetError, SmallestModel, smallest_model
from fembeam.study.stationary import Response, characteristics, stationary

__all__ = [
    "Ensemble",
    "ModeCount",
    "NotMetError",
    "Response",
    "SmallestModel",
    "characteristics",
    "ensemble",
    "mode_count",
    "smallest_model",
    "stationary",
]
