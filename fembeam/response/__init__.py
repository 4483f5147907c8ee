"""What is evaluated from a run or a model: accelerations, section forces, support reactions, mean forces, spectra,
transfer functions.

Each file answers one question with functions of a `Run` or a `Model`, which offer them as methods. `readout`
holds what they need of a run besides its coordinates, and what its file keeps. Imports: `scene`, `beams`, `support`,
`reduction`. Begin with `readout`.
"""

from fembeam.response.backbone import backbone
from fembeam.response.contact_force import forces, latched_before
from fembeam.response.friction import losses_by_friction, read_back, sliding, states
from fembeam.response.mean_force import mean_force
from fembeam.response.readout import Readout, coordinates, frame_motion
from fembeam.response.saved_readout import READOUT_FINITE, READOUT_UNITS, expected_readout, packed, unpacked
from fembeam.response.section_forces import Extremes, SectionForces, extremes, frame_forces_of, rows_of, section_forces
from fembeam.response.spectra import ResponseSpectrum, floor_spectrum, response_spectrum
from fembeam.response.support_reactions import BodyReaction, Reaction, Reactions, reactions
from fembeam.response.transfer import FrequencyResponse, frequency_response
