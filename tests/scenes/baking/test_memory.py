"""What was freed goes back to the system, although something above it is still in use."""

import ctypes
from pathlib import Path

import pytest

from scenes.baking.memory import give_memory_back

PIECES, PIECE_BYTES = 2000, 64_000
"""So small that the C library takes them from its heap: 128 MB."""


def resident_bytes():
    return 4096 * int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), "malloc_trim"), reason="only glibc gives back")
def test_what_was_freed_is_given_back():
    pieces = [b"1" * PIECE_BYTES for _ in range(PIECES)]
    above = b"1" * PIECE_BYTES
    full = resident_bytes()
    pieces.clear()
    give_memory_back()
    assert full - resident_bytes() > 0.8 * PIECES * PIECE_BYTES
    assert len(above) == PIECE_BYTES
