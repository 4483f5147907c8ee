"""Studies: questions asked of a scene or a model by many runs, each answered by a table and a figure."""

from fembeam.study.ensemble import Ensemble, ensemble
from fembeam.study.failure_gallery import Failure, gallery
from fembeam.study.mode_count import ModeCount, mode_count
from fembeam.study.settling import Basins, Bifurcation, basins, bifurcation
from fembeam.study.smallest_model import smallest_model
from fembeam.study.smallest_model_result import NotMetError, SmallestModel
from fembeam.study.speed_accuracy import NoReferenceError, speed_accuracy
from fembeam.study.speed_accuracy_result import Point, SpeedAccuracy
from fembeam.study.stability_map import StabilityMap, Verdict, stability_map
from fembeam.study.stationary import characteristics, stationary
from fembeam.study.stationary_result import Response

__all__ = [
    "Basins",
    "Bifurcation",
    "Ensemble",
    "Failure",
    "ModeCount",
    "NoReferenceError",
    "NotMetError",
    "Point",
    "Response",
    "SmallestModel",
    "SpeedAccuracy",
    "StabilityMap",
    "Verdict",
    "basins",
    "bifurcation",
    "characteristics",
    "ensemble",
    "gallery",
    "mode_count",
    "smallest_model",
    "speed_accuracy",
    "stability_map",
    "stationary",
]
