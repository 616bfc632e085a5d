"""Images of the steps, one each."""

from __future__ import annotations

import re


def test_each_step_has_its_image(exported):
    folder = exported.folder / "assembly"
    text = (folder / "steps.md").read_text(encoding="utf-8")
    images = re.findall(r"\]\((step_\d\d\.png)\)", text)
    assert images == sorted(path.name for path in folder.glob("*.png"))
    assert len(images) == len(re.findall(r"^\d+\. ", text, flags=re.MULTILINE))
