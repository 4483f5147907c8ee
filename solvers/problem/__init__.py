"""What is to be solved, and what comes out; nothing compiled is imported here.

M q'' + C q' + K q = Σ v_l s_l(t) + Σ w_c F_c(-w_c·q - gap_c, ...)

`system` holds matrices, contacts and loads, `decoupling` makes blocks of them, `signals` samples loads for compiled
code, `common_grid` puts the samples of several on one grid, `friction` is that of a contact, `memo` keeps what was
computed once, `event_list` names the columns of what a run logs, `record` is what a run leaves, `result` the solution
with its log of contacts and its energies, `frames` its tables, `losses` the energy that contacts dissipated, `renewals`
calls laws with memory, `run_arguments` checks what a run is given, `whole_runs` says what Ctrl-C leaves of it. Imports:
numpy, scipy. Begin with `system.System`.
"""

from solvers.problem.common_grid import on_one_grid
from solvers.problem.decoupling import decouple
from solvers.problem.frames import columns_of, dataframe, optional
from solvers.problem.friction import Friction
from solvers.problem.losses import Losses
from solvers.problem.matrices import Array, dense, product
from solvers.problem.memo import Memo
from solvers.problem.record import Record
from solvers.problem.renewals import renew, renewal_slopes
from solvers.problem.result import (
    ContactLog,
    Cost,
    Energy,
    FrictionLog,
    Solution,
    SolverError,
    Status,
    Transitions,
    counted,
)
from solvers.problem.signals import Forcing, forcing_of, quintics, tones_as_nodes, tones_of
from solvers.problem.system import Contact, Law, Parameter, System, require_step
