"""What the tests of the studio's page share."""

import pytest


@pytest.fixture(scope="module")
def browser():
    from studio_page import chromium

    with chromium() as browser:
        yield browser
