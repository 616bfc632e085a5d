"""The dive file that a user begins with."""

from __future__ import annotations

import pytest

from dives import Dive
from dives.planning.starter import create_dive_file
from rigs.new_rig import create_rig_file


def test_it_is_a_dive_with_its_comments(tmp_path):
    file = tmp_path / "harbour.toml"
    create_dive_file("harbour", file, rig="bluerov2")
    dive = Dive.load(file)
    assert (dive.name, dive.rig) == ("harbour", "bluerov2")
    text = file.read_text(encoding="utf-8")
    assert text.count("#") > 20
    # What is commented out is ready to be used.
    uncommented = text.replace("# [target.start]", "[target.start]").replace("# azimuth_deg", "azimuth_deg")
    uncommented = uncommented.replace("# [[decoys]]", "[[decoys]]").replace("# position_m", "position_m")
    file.write_text(uncommented, encoding="utf-8")
    assert len(Dive.load(file).decoys) == 1


def test_a_rig_file_of_ones_own_is_found_from_the_dive(tmp_path):
    create_rig_file("mine", tmp_path / "mine.toml")
    (tmp_path / "dives").mkdir()
    file = tmp_path / "dives" / "harbour.toml"
    create_dive_file("harbour", file, rig=str(tmp_path / "mine.toml"))
    assert Dive.load(file).load_rig().name == "mine"


def test_what_cannot_be_is_refused_and_nothing_is_written(tmp_path):
    file = tmp_path / "harbour.toml"
    with pytest.raises(ValueError, match="Not A Name"):
        create_dive_file("Not A Name", file)
    with pytest.raises(FileNotFoundError, match="nix"):
        create_dive_file("harbour", file, rig="nix")
    assert not file.exists()
    file.write_text("mine", encoding="utf-8")
    with pytest.raises(FileExistsError):
        create_dive_file("harbour", file)
    assert file.read_text(encoding="utf-8") == "mine"
