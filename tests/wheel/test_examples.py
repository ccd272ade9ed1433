"""Every public class and function has an example in its documentation, and every public method is in one. Doctest runs them."""

from __future__ import annotations

import doctest
import inspect
import re

import pytest
import wstac

PUBLIC = [name for name in wstac.__all__ if not name.startswith("_")]


def code(documentation: str | None) -> str:
    """Returns the code of the examples in a documentation."""
    return "".join(example.source for example in doctest.DocTestParser().get_examples(documentation or ""))


def methods(kind: type) -> dict[str, object]:
    """Returns the public methods and properties of a class, also those of its base."""
    return {
        name: member
        for base in kind.__mro__
        if base.__module__.startswith("wstac")
        for name, member in vars(base).items()
        if not name.startswith("_") and (inspect.isroutine(member) or isinstance(member, (property, classmethod, staticmethod)))
    }


CLASSES = [value for name in PUBLIC if inspect.isclass(value := getattr(wstac, name))]
METHODS = [(kind, name) for kind in CLASSES for name in methods(kind)]


@pytest.mark.parametrize("name", PUBLIC)
def test_a_class_or_a_function_has_an_example(name: str) -> None:
    assert "wstac" in code(inspect.getdoc(getattr(wstac, name)))


@pytest.mark.parametrize(("kind", "name"), METHODS, ids=[f"{kind.__name__}.{name}" for kind, name in METHODS])
def test_a_method_is_in_an_example(kind: type, name: str) -> None:
    assert inspect.getdoc(methods(kind)[name])
    written = code(inspect.getdoc(kind)) + "".join(code(inspect.getdoc(member)) for member in methods(kind).values())
    assert re.search(rf"\.{name}\b", written)


def test_there_are_classes_and_methods() -> None:
    assert len(PUBLIC) > 25 and len(METHODS) > 60
