"""Tests of what is refused, made of their cases."""

import pytest


def refused(*cases, error=ValueError):
    """Each case is a call without arguments, what is said of it, and the error if it is another one."""

    @pytest.mark.parametrize("case", cases, ids=[case[1] for case in cases])
    def test(case):
        make, said, *other = case
        with pytest.raises(other[0] if other else error, match=said):
            make()

    return test


def refused_by(call, *cases, error=ValueError):
    """Each case holds the arguments of the call and, last, what is said of them."""
    return refused(*((lambda case=case: call(*case[:-1]), case[-1]) for case in cases), error=error)


def refused_files(text, *cases, error=ValueError):
    """Each case is a part of a scene file's text, what stands there instead, once, and what is said of it."""

    @pytest.mark.parametrize(("old", "new", "said"), cases, ids=[str(i) for i in range(len(cases))])  # in the path
    def test(file_of, old, new, said):
        assert old in text
        with pytest.raises(error, match=said) as caught:
            file_of(text.replace(old, new, 1))
        assert "scene.toml" in str(caught.value)

    return test
