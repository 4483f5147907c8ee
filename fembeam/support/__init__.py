"""What all of fembeam needs: checks of arguments, whole files, progress, signals of the system, digests of values.

Imports nothing of ours.
"""

from fembeam.support.cards import Block, Card, abaqus_blocks, check_abaqus, nastran_cards, real
from fembeam.support.changes import changes
from fembeam.support.checks import (
    LARGEST,
    frozen,
    has_switches,
    in_mm,
    is_finite,
    is_listed,
    is_name,
    is_number,
    is_numbered,
    is_one_of,
    is_pair,
    is_whole,
    make_native,
    native,
    number,
    numbers,
    require,
    require_finite,
    require_non_negative,
    require_place,
    require_positive,
    require_seed,
    require_switch,
    tuples,
    vector,
)
from fembeam.support.files import DRAFT, file_path, one_at_a_time, read_with, write_rows, written_beside, written_whole
from fembeam.support.notes import note, warn
from fembeam.support.printed import Part, Printed, html_table
from fembeam.support.progress import bar, counting, titled
from fembeam.support.text_tables import aligned, by_rows
from fembeam.support.versions import versions
