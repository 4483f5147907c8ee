"""Studies: questions asked of a scene or a model by many runs, each answered by a table and a figure."""

from fembeam.study.failures import Failure, gallery
from fembeam.study.speed_accuracy import NoReferenceError, Point, SpeedAccuracy, speed_accuracy
from fembeam.study.stability_map import StabilityMap, Verdict, stability_map

__all__ = [
    "Failure",
    "NoReferenceError",
    "Point",
    "SpeedAccuracy",
    "StabilityMap",
    "Verdict",
    "gallery",
    "speed_accuracy",
    "stability_map",
]
