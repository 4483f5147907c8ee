"""What is evaluated from a run or a model: accelerations, section forces, support reactions, mean forces, spectra,
transfer functions.

Each file answers one question. `histories` are what a run shows, from its coordinates and the log of its contacts, with
the rows of `shapes` and of `placed_shapes`; `readout` holds what else that takes, of a model or of a file. The others
are functions of these or of a `Model`. Imports: `scene`, `beams`, `support`, `reduction`, `contacts`. Begin with
`histories`.
"""

from fembeam.response.along_members import known_along_members
from fembeam.response.backbone import backbone
from fembeam.response.contact_force import forces, latched_before
from fembeam.response.contact_log import PlacedLog, Site, site
from fembeam.response.friction import losses_by_friction, read_back, sliding, states
from fembeam.response.histories import Histories, directed, frame_motion, modal_accelerations
from fembeam.response.mean_force import mean_force
from fembeam.response.placed_shapes import PlacedShapes, placed_shapes
from fembeam.response.readout import READOUT_FINITE, READOUT_UNITS, Readout, expected_readout, packed, unpacked
from fembeam.response.section_forces import Extremes, SectionForces, extremes, frame_forces_of, rows_of, section_forces
from fembeam.response.shapes import Shapes
from fembeam.response.spectra import ResponseSpectrum, floor_spectrum, response_spectrum
from fembeam.response.support_reactions import BodyReaction, Reaction, Reactions, reactions
from fembeam.response.transfer import FrequencyResponse, frequency_response
