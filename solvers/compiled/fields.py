"""Fields of the named tuples that compiled code reads and writes: each is declared once, with its shape.

    class State(NamedTuple):
        x: Annotated[Any, "X"]  # (X,) numbers
        count: Annotated[Any, "int 8"]  # whole numbers
        fastest: Annotated[float, "number"]  # no array

The dimensions of an array stand between commas: names, whole numbers, and sums and products of these, such as 2*N. From
the declaration come numba's type and, with a size for each name, the shapes of the arrays.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Any, get_type_hints

import numpy as np
from numba import types

_KINDS = {"int": types.int64, "complex": types.complex128}


@lru_cache(maxsize=64)
def _declared(tuple_class: type) -> tuple[tuple[str, Any, tuple[str, ...]], ...]:
    """Name, numba's type of the numbers, and dimensions of every field; of a plain number there are none."""

    def fields() -> Iterator[tuple[str, Any, tuple[str, ...]]]:
        for name, hint in get_type_hints(tuple_class, include_extras=True).items():
            kind, _, rest = hint.__metadata__[0].partition(" ")
            shape = rest if kind in _KINDS else hint.__metadata__[0]
            dimensions = () if shape == "number" else tuple(part.strip() for part in shape.split(","))
            yield name, _KINDS.get(kind, types.float64), dimensions

    return tuple(fields())


def packed_type(tuple_class: type) -> types.NamedTuple:
    """Numba's type of a named tuple of contiguous arrays and plain numbers."""
    kinds = [types.Array(kind, len(shape), "C") if shape else kind for _, kind, shape in _declared(tuple_class)]
    return types.NamedTuple(kinds, tuple_class)


def shapes_of(tuple_class: type, sizes: Mapping[str, int]) -> list[tuple[int, ...]]:
    """Shapes of the arrays of a named tuple; ``sizes`` has the size of every name."""
    return [tuple(_size(part, sizes) for part in shape) for _, _, shape in _declared(tuple_class)]


def zeros_of(tuple_class: type, sizes: Mapping[str, int]) -> Any:
    """A named tuple of arrays of zeros; ``sizes`` has the size of every name."""
    kinds = [str(kind) for _, kind, _ in _declared(tuple_class)]
    arrays = [np.zeros(shape, kind) for shape, kind in zip(shapes_of(tuple_class, sizes), kinds, strict=True)]
    return tuple_class(*arrays)


def _size(dimension: str, sizes: Mapping[str, int]) -> int:
    """A sum of products of names and numbers, such as S+2 or 2*N."""
    products = (product.split("*") for product in dimension.split("+"))
    return sum(math.prod(int(part) if part.isdigit() else sizes[part] for part in product) for product in products)
