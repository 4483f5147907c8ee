"""Studies: questions asked of a scene or a model by many runs, each answered by a table and a figure.

How many modes (`mode_count`, `smallest_model`), which method and step (`speed_accuracy`, `stability_map`), what random
motion looks like (`ensemble` of realisations, `stationary` for one long run in `segments`), where motion settles
(`settling`). A study is a function and its result; `quantities` are the numbers that it can ask for, `measure` takes
them, `realisations` gives every run its own noise, `execution` spreads runs over processes and keeps what was computed.
Imports: `plot`, `model`, `statistics` and what they import.
Begin with `measure`, then `ensemble`.
"""

from fembeam.study.ensemble import Ensemble, ensemble
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
    "mode_count",
    "smallest_model",
    "speed_accuracy",
    "stability_map",
    "stationary",
]
