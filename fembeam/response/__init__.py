"""What engineers read off a run or a model: accelerations, support reactions, response spectra, frequency response.

Each file answers one question with functions of a `Run` or a `Model`, which offer them as methods; they know neither.
Imports: `scene`, `beams`, `support`, `reduction`. Begin with `acceleration`, then `support_reactions`.
"""

from fembeam.response.acceleration import coordinates, frame_motion, model_of
from fembeam.response.support_reactions import Reaction, Reactions, reactions

__all__ = ["Reaction", "Reactions", "coordinates", "frame_motion", "model_of", "reactions"]
