"""TOML that no person writes is refused in a moment, with its line; what people write is read."""

from __future__ import annotations

import tomllib

import pytest

from dives.dive import PRESETS as DIVES
from rigs import preset_path
from rigs.documents.toml import MOST_DEEP, TomlError, parsed

TRICKY = (
    """
a = "[[[[ # no comment" # [[[[
b = '''
[[ ' . . . . . . . . . . . . . . . . . . . . . . . . . . . . . . . . . . . . . .
'''
c = """
    + '"""{{ \\""" ""\n"""'
    + """
d = [1.5, 2.5, -3.5e-3, 0x1f, 12:00:00.5, [[{x.y = {z = 1}}]]]
[e."f.g".h]
i = 1
"""
)


def test_what_people_write_is_read():
    for path in (preset_path("aqua2"), *DIVES.glob("*.toml")):
        text = path.read_text(encoding="utf-8")
        assert parsed(text) == tomllib.loads(text)
    assert parsed(TRICKY) == tomllib.loads(TRICKY)
    deep = "x = " + "[" * (MOST_DEEP - 1) + "]" * (MOST_DEEP - 1)
    assert parsed(deep) == tomllib.loads(deep)


TOO_DEEP = f"line 1: expected tables and lists at most {MOST_DEEP} deep"
ATTACKS = {
    "lists": ("\nx = " + "[" * 1200 + "]" * 1200, f"line 2: expected tables and lists at most {MOST_DEEP} deep"),
    "inline tables": ("x = " + "{a = " * 1200, TOO_DEEP),
    "table": ("[" + ".".join(["a"] * 100_000) + "]", TOO_DEEP),
    "key": (".".join(["a"] * 100_000) + " = 1", TOO_DEEP),
    "quoted key": (
        " . ".join(['"a"'] * 100_000) + " = 1",
        TOO_DEEP,
    ),
    "digits": ("x = 1\ny = " + "9" * 5000, "line 2: expected keys and numbers of at most 1,000 characters"),
    "size": ("#" * 2_000_001, "line 1: expected a file of at most 2,000,000 characters, got 2,000,001"),
    "open text": ('x = """' + '\\"""' * 100_000, "end of document: expected valid TOML: "),
    "many open texts": ("x = 'a' '" * 50_000, "line 1, column 9: expected valid TOML: "),
}


@pytest.mark.parametrize(("text", "sentence"), ATTACKS.values(), ids=ATTACKS)
def test_what_no_person_writes_is_refused(text, sentence):
    with pytest.raises(TomlError) as caught:
        parsed(text)
    assert str(caught.value).startswith(sentence)
