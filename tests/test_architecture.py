"""The page on the architecture names every room, and no hall is too large to find one's way in."""

from pathlib import Path

import pytest

CHECKOUT = Path(__file__).resolve().parent.parent
PACKAGES = ("rigs", "optics", "cad", "scenes", "tracking", "dives", "reports", "studio", "mirrorgaze")
MOST_MODULES = 16

ROOMS = [
    file.parent.relative_to(CHECKOUT) for package in PACKAGES for file in (CHECKOUT / package).rglob("__init__.py")
]


@pytest.mark.parametrize("room", [room for room in ROOMS if room.parts[0] not in ("reports", "mirrorgaze")], ids=str)
def test_every_room_is_on_the_page(room):
    page = (CHECKOUT / "docs/explanation/architecture.md").read_text(encoding="utf-8")
    assert f"`{room}/`" in page


@pytest.mark.parametrize("room", ROOMS, ids=str)
def test_a_room_has_few_modules_and_says_what_it_is_for(room):
    modules = [path for path in (CHECKOUT / room).glob("*.py") if path.name != "__init__.py"]
    assert len(modules) <= MOST_MODULES
    assert (CHECKOUT / room / "__init__.py").read_text(encoding="utf-8").startswith('"""')
