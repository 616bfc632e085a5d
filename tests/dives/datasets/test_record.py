"""The record of a sample, read again."""

import json

import pytest

from dives.datasets.record import SampleRecord


def test_a_record_of_another_version_is_refused_in_a_sentence():
    with pytest.raises(ValueError, match=r"as this version writes it.*make the set again"):
        SampleRecord.of_json(json.dumps({"index": 0, "files": {}}).encode())
