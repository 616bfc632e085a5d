"""Rigs on hulls whose mounts are not placed."""

from __future__ import annotations

import pytest
import tomlkit

from cad.placement.placement import Placement
from rigs import Rig


@pytest.fixture
def unplaced(monkeypatch):
    """Leave camera, mirrors and anchors where the preset has them: tests/reports/studies places them."""

    def stay(document, folder, hull, **_):
        return Placement(rig=Rig.parse(tomlkit.dumps(document), source="reef", folder=folder), reasons={}, rejected=())

    monkeypatch.setattr("reports.studies.new_rig.place_document", stay)
