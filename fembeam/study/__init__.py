"""Studies: questions asked of a scene or a model by many runs, each answered by a table and a figure."""

from fembeam.study.bifurcation import Bifurcation, bifurcation
from fembeam.study.ensemble import Ensemble, ensemble
from fembeam.study.failures import Failure, gallery
from fembeam.study.mode_count import ModeCount, mode_count
from fembeam.study.points import Point, SpeedAccuracy
from fembeam.study.smallest_model import NotMetError, SmallestModel, smallest_model
from fembeam.study.speed_accuracy import NoReferenceError, speed_accuracy
from fembeam.study.stability_map import StabilityMap, Verdict, stability_map
from fembeam.study.stationary import Response, characteristics, stationary

__all__ = [
    "Bifurcation",
    "bifurcation",
    "Failure",
    "NoReferenceError",
    "Point",
    "SpeedAccuracy",
    "StabilityMap",
    "Verdict",
    "gallery",
    "speed_accuracy",
    "stability_map",
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
