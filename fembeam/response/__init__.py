"""What engineers read off a run or a model: accelerations, support reactions, mean forces, spectra, transfer functions.

Each file answers one question with functions of a `Run` or a `Model`, which offer them as methods; they know neither.
Imports: `scene`, `beams`, `support`, `reduction`. Begin with `acceleration`, then `support_reactions`.
"""

from fembeam.response.acceleration import coordinates, frame_motion, model_of
from fembeam.response.contact_force import contact_force
from fembeam.response.mean_force import mean_force
from fembeam.response.spectra import ResponseSpectrum, floor_spectrum, response_spectrum
from fembeam.response.support_reactions import Reaction, Reactions, reactions
from fembeam.response.transfer import FrequencyResponse, frequency_response

__all__ = [
    "FrequencyResponse",
    "Reaction",
    "Reactions",
    "ResponseSpectrum",
    "contact_force",
    "coordinates",
    "floor_spectrum",
    "frame_motion",
    "frequency_response",
    "mean_force",
    "model_of",
    "reactions",
    "response_spectrum",
]
