"""Studies: questions asked of a scene or a model by many runs, each answered by a table and a figure.

How many modes (`mode_count`, `smallest_model`), which method and step (`speed_accuracy`, `stability_map`), what random
motion looks like (`ensemble` of realisations, `stationary` for one long run in `segments`), where motion settles
(`basins`, `bifurcation`), how a rotor whirls (`campbell`), how a law stiffens and damps over the amplitude
(`equivalent`), how a resonance changes with amplitude (`backbone`) and with a second number (`peak`, `fold`), what
parameters change (`vary`) and where a quantity is least (`minimise`), what equipment at some places has to stand
(`floor_spectra`). A study is a function and
its `Result`; `quantities` are the numbers that it can ask for, `measure` takes them, `realisations` gives every run its
own noise, `execution` spreads runs over processes and keeps what was computed. Imports: `plot`, `model`, `statistics`
and what they import. Begin with `measure`, then `ensemble`.
"""

from fembeam.study.backbone import Backbone, Resonance, backbone
from fembeam.study.basins import Basins, basins
from fembeam.study.bifurcation import Bifurcation, bifurcation
from fembeam.study.campbell import Campbell, campbell
from fembeam.study.ensemble import Ensemble, ensemble
from fembeam.study.equivalent import Equivalent, equivalent
from fembeam.study.floor_spectra import FloorSpectra, floor_spectra
from fembeam.study.fold import Fold, fold
from fembeam.study.minimum import Limit, Minimum, minimise
from fembeam.study.mode_count import ModeCount, mode_count
from fembeam.study.peak import Peak, Top, peak
from fembeam.study.smallest_model import NotMetError, SmallestModel, smallest_model
from fembeam.study.speed_accuracy import NoReferenceError, Point, SpeedAccuracy, speed_accuracy
from fembeam.study.stability_map import StabilityMap, Verdict, stability_map
from fembeam.study.stationary import Response, characteristics, stationary
from fembeam.study.variation import Variation, vary

__all__ = [
    "Backbone", "Basins", "Bifurcation", "Campbell", "Ensemble", "Equivalent", "FloorSpectra", "Fold", "Limit",
    "Minimum", "ModeCount", "NoReferenceError", "NotMetError", "Peak", "Point", "Resonance", "Response",
    "SmallestModel", "SpeedAccuracy", "StabilityMap", "Top", "Variation", "Verdict", "backbone", "basins",
    "bifurcation", "campbell", "characteristics", "ensemble", "equivalent", "floor_spectra", "fold", "minimise",
    "mode_count", "peak", "smallest_model", "speed_accuracy", "stability_map", "stationary", "vary",
]  # fmt: skip
