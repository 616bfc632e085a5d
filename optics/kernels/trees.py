"""Trees: dataclasses, dicts and tuples of them, with whatever else at their leaves; None where there is nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Structure:
    """How a tree is nested, without its leaves; hashable.

    Attributes
    ----------
    make : type
        Dataclass, dict or tuple.
    children : tuple of (name, Structure or None)
        None for a leaf. Children that are None are left out: fields that may be have it for their default.
    """

    make: Callable[..., Any]
    children: tuple[tuple[str, Structure | None], ...]

    def filled(self, leaves: Iterator[Any]) -> Any:
        """The tree with these leaves."""
        children = {name: next(leaves) if child is None else child.filled(leaves) for name, child in self.children}
        return tuple(children.values()) if self.make is tuple else self.make(**children)


def is_tree(value: Any) -> bool:
    """Whether a value is a dataclass or a tuple with one in it: what Dr.Jit is not handed as it is."""
    return hasattr(value, "__dataclass_fields__") or (isinstance(value, tuple) and any(map(is_tree, value)))


def structure_of(tree: Any) -> Structure:
    """Structure of a tree that is no leaf."""
    children = _children(tree)
    if children is None:
        raise TypeError(f"expected a dataclass, a dict or a tuple, got {type(tree)}")
    return Structure(
        type(tree),
        tuple(
            (str(name), None if _children(child) is None else structure_of(child))
            for name, child in children
            if child is not None
        ),
    )


def leaves_of(tree: Any) -> list[Any]:
    """Leaves of a tree in their order."""
    found: list[Any] = []
    _gather(tree, found)
    return found


def _gather(tree: Any, found: list[Any]) -> None:
    children = _children(tree)
    if children is not None:
        for _, child in children:
            _gather(child, found)
    elif tree is not None:
        found.append(tree)


def _children(tree: Any) -> Iterable[tuple[Any, Any]] | None:
    if isinstance(tree, dict):
        return tree.items()
    if isinstance(tree, tuple):
        return enumerate(tree)
    return vars(tree).items() if hasattr(tree, "__dataclass_fields__") else None
