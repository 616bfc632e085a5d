"""Sentences about what is wrong, collected, so that a user reads all of it at once."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


class Problems:
    """Collects what several checks raise, to raise it as one `ValueError`."""

    def __init__(self) -> None:
        self.sentences: list[str] = []

    @contextmanager
    def collecting(self) -> Iterator[None]:
        """Keep the sentence of a `ValueError` from the block, and go on behind it."""
        try:
            yield
        except ValueError as error:
            self.sentences.append(str(error))

    def raise_any(self) -> None:
        """Raise a `ValueError` with all sentences, when there are any."""
        if self.sentences:
            raise ValueError("; ".join(self.sentences))
