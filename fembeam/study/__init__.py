"""Studies: questions asked of a scene or a model by many runs, each answered by a table and a figure."""

from fembeam.study.ensemble import Ensemble, ensemble
from fembeam.study.stationary import Response, characteristics, stationary

__all__ = ["Ensemble", "Response", "characteristics", "ensemble", "stationary"]
