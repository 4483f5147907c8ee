"""Matrix Market: "%%MatrixMarket matrix coordinate real symmetric", comments, sizes, entries (numbered from 1)."""

from __future__ import annotations

from pathlib import Path

from scipy import io, sparse

from fembeam.structures.readers.given import Given, wrong

HEAD = b"%%MatrixMarket"


def read_matrix_market(path: Path) -> Given:
    """The one matrix of a Matrix Market file; symmetric ones are completed. It has no labels."""
    try:
        _, _, _, layout, field, symmetry = io.mminfo(path)
    except (ValueError, OSError, OverflowError) as error:
        raise wrong(path, "line 1", '"%%MatrixMarket matrix", then sizes', error) from None
    if field not in ("real", "integer") or symmetry not in ("general", "symmetric"):
        raise wrong(path, "line 1", "a real matrix, general or symmetric", f"{field} {symmetry}")
    try:
        found = io.mmread(path)
    except (ValueError, OSError, OverflowError) as error:
        raise wrong(path, "its entries", f"as many as the sizes say ({layout})", error) from None
    return Given(path, ((path.stem, sparse.csr_matrix(found, dtype=float)),))
