"""The spectra that a rig names are read before anything is made with them."""

from __future__ import annotations

import pytest

from rigs import Rig, Water
from scenes.light.rig_spectra import spectrum_problems

GOOD_IOP = "wavelength_nm,a_per_m,b_per_m\n350,0.1,0.2\n750,0.3,0.2\n"
GOOD_RESPONSE = "wavelength_nm,red,green,blue\n400,0,0,1\n550,0,1,0.5\n700,1,0,0\n"
GARBAGE = {
    "empty": b"",
    "bytes": bytes(range(256)) * 8,
    "binary with NUL": b"\x80\xff\x00\x01",
    "NUL in text": b"wavelength_nm,a_per_m,b_per_m\n350,0\x00.1,0.2\n",
    "words": b"ISO-10303-21;\nHEADER;\n",
    "header alone": b"wavelength_nm,a_per_m,b_per_m\n",
    "not finite": GOOD_IOP.replace("0.3", "nan").encode(),
    "infinite": GOOD_IOP.replace("0.3", "1e999").encode(),
    "negative": GOOD_IOP.replace("0.3", "-1").encode(),
    "too narrow": GOOD_IOP.replace("350", "600").encode(),
    "descending": GOOD_IOP.replace("350", "900").encode(),
    "no red": GOOD_RESPONSE.replace("1,0,0\n", "0,0,0\n").encode(),
    "short line": GOOD_RESPONSE.replace(",1,0.5", "").encode(),
    "long field": b"wavelength_nm," + b"a" * 200_000,
    "quote": b'wavelength_nm,"a_per_m\n' * 100,
}


def named(tmp_path, iop=None, response=None) -> Rig:
    rig = Rig.load("aqua2")
    for name, content in (("iop.csv", iop), ("response.csv", response)):
        if content is not None:
            (tmp_path / name).write_bytes(content)
    water = rig.water if iop is None else Water(iop_file=tmp_path / "iop.csv")
    camera = rig.camera.model_copy(update={"response_file": None if response is None else tmp_path / "response.csv"})
    return rig.model_copy(update={"water": water, "camera": camera})


def test_good_spectra_have_no_problem(tmp_path):
    assert spectrum_problems(named(tmp_path, GOOD_IOP.encode(), GOOD_RESPONSE.encode())) == []
    assert spectrum_problems(Rig.load("aqua2")) == []


@pytest.mark.parametrize("content", GARBAGE.values(), ids=GARBAGE)
def test_what_is_no_spectrum_is_told_with_the_key_of_the_file(tmp_path, content):
    problems = spectrum_problems(named(tmp_path, content, content))
    assert {problem.place for problem in problems} == {"camera.response_file", "water.iop_file"}
    assert all(str(tmp_path) not in str(problem) for problem in problems)
