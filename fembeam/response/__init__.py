"""What engineers read off a run or a model: accelerations, support reactions, response spectra, frequency response.

Each file answers one question with functions of a `Run` or a `Model`, which offer them as methods; they know neither.
Imports: `scene`, `beams`, `support`, `reduction`. Begin with `acceleration`, then `reactions`.
"""

from fembeam.response.acceleration import coordinates, frame_motion, model_of

__all__ = ["coordinates", "frame_motion", "model_of"]
