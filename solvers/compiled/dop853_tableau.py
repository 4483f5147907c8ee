"""Coefficients of Dormand and Prince's method of order 8, those published with SciPy's `scipy.integrate.DOP853`.

Rows of A: the stages, the step's end (row `STAGES`), three more for dense output. E3 and E5 give the embedded
differences of order 3 and 5, D the rows of the interpolant.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import DOP853

STAGES, EXTENDED = 12, 16
A = np.zeros((EXTENDED, EXTENDED))
A[:STAGES, :STAGES] = DOP853.A[:STAGES, :STAGES]
A[STAGES, :STAGES] = DOP853.B
A[STAGES + 1 :, :] = DOP853.A_EXTRA
C = np.concatenate([DOP853.C[:STAGES], [1.0], DOP853.C_EXTRA])
E3, E5, D = np.array(DOP853.E3), np.array(DOP853.E5), np.array(DOP853.D)
