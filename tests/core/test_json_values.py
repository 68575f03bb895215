from __future__ import annotations

import json
import math
from enum import StrEnum

import numpy as np
import pytest

from cityflow.core.credentials import stripped, without_credentials
from cityflow.core.json_values import finite, rounded


class Kind(StrEnum):
    ONE = "one"


def test_whatever_numbers_are_in_it_strict_json_can_say_it() -> None:
    value = {
        "nan": math.nan, "inf": -math.inf, "deep": [({"x": np.float32("nan")},), np.int64(3), np.float64("inf"), np.bool_(True)], 7: Kind.ONE, "none": None,
    }  # fmt: skip
    said = json.loads(json.dumps(finite(value), allow_nan=False))
    assert said == {"nan": None, "inf": None, "deep": [[{"x": None}], 3, None, True], "7": "one", "none": None}


def test_truth_values_stay_truth_values_and_large_numbers_whole() -> None:
    assert finite([True, 2**70, 0.1]) == [True, 2**70, 0.1]
    assert finite(True) is True


@pytest.mark.parametrize(
    ("value", "decimals", "out"),
    [(1.23456, 3, 1.235), (-0.0004, 3, 0.0), (1e9, 1, 1e9), (math.nan, 3, None), (-math.inf, 0, None)],
)
def test_figures_are_rounded_or_nothing(value: float, decimals: int, out: float | None) -> None:
    assert rounded(value, decimals) == out


SECRET = "hush"


@pytest.mark.parametrize(
    "text",
    [
        f"https://joe:{SECRET}@host/a", f"https://{SECRET}@host", f"s3://b/a?AWSAccessKeyId={SECRET}&x=1", f"see https://h/a?sig={SECRET}, and",
        f"az://c/a?sv=1&sas_token={SECRET}#top", f"https://h/a?X-Amz-Credential={SECRET}%2Fa&X-Amz-Signature={SECRET}", f"(https://h?API_KEY={SECRET})",
        f"https://joe:{SECRET}@a/b and https://joe:{SECRET}@c/d",
    ],
)  # fmt: skip
def test_no_text_keeps_its_secret(text: str) -> None:
    assert SECRET not in without_credentials(text)
    assert SECRET not in json.dumps(stripped({"a": [text, (text,)]}))


@pytest.mark.parametrize("text", ["https://host/a@2x.png", "s3://bucket/key/monkey.laz", "mail joe@host", "https://h/a?x=1&page=2"])  # fmt: skip
def test_what_is_no_secret_stays(text: str) -> None:
    assert without_credentials(text) == text


def test_other_values_stay_as_they_are() -> None:
    assert stripped({"a": 1, "b": None, "c": [True, 2.5]}) == {"a": 1, "b": None, "c": [True, 2.5]}
