"""Random scenes: `Exponential` against `DormandPrince`, thousands of them; prints every failure.

    python tests/bench/random_scenes.py [count] [first seed] [processes]

A scene is a structure with one to four stops, oscillators that influence each other little or not at all, or a
symmetric pair of stops; with laws and loads of every kind, starts in contact, ends in contact, and a tolerance from
1e-3 to 1e-11. Seeds from 100000 on draw beams on pins under one to three sampled loads, dashpots on nodes of modes, and
stops pressed at rest; those from 200000000 on masses that fall on stops by their weight, lie there, and are pushed by
loads, some of which cancel but for rounding; those from 300000000 on structures that are slow or fast beside the cells
of their loads; those from 400000000 are the first ones again with modes of one frequency, tones at resonance, damping
that drives beside more that damps, in coordinates stretched by up to 1e3. Seeds from 800000000 on draw modes 300 to 1e5
times as fast as others that follow moving supports, those from 900000000 such that rest until stops push them. Compared
are the motion at samples and, of every contact, times, rates, peaks, impulse and loss; runs with and without samples,
which fly in other steps, and the energy balance. What a difference is worth: see `comparison`.
"""

from __future__ import annotations

from comparison import Verdict, against, cut_after_contacts, main, references, strictly
from drawn import FOLLOWING_FROM, draw
from drawn_wider import with_coincidences

COINCIDING_FROM = 400_000_000  # the first seed


def judge(seed: int) -> tuple[str, Verdict]:
    """Draw, run and compare."""
    coinciding = COINCIDING_FROM <= seed < FOLLOWING_FROM
    scene, rtol = draw(seed % COINCIDING_FROM if coinciding else seed)
    scene = with_coincidences(seed, scene) if coinciding else scene
    with strictly():
        theirs, again, _ = references(scene, lambda scene: cut_after_contacts(scene, seed))
        return f"seed {seed}: {scene.words}", against(scene, theirs, again, rtol, seed)


if __name__ == "__main__":
    main(judge)
