from __future__ import annotations

import re
import sys

from hypothesis import example, given, settings
from hypothesis import strategies as st
from lxml import etree

from cityflow.io.attributes import ncname, scalar, scalars, xml_text

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.-]*\Z")


@settings(deadline=None, max_examples=50)
@given(st.lists(st.text(max_size=12), min_size=2, max_size=8, unique=True))
def test_different_ids_get_different_names(ids: list[str]) -> None:
    names = [ncname("b", i) for i in ids]
    assert all(NAME.match(name) for name in names)
    assert len(set(names)) == len(ids)


def test_names_that_look_escaped_already_stay_apart() -> None:
    assert ncname("b", "a b") == "b-a_x20_b"
    assert ncname("b", "a_x20_b") == "b-a_x5F_x20_b"
    assert ncname("b", "_x") != ncname("b", "_")


@settings(deadline=None, max_examples=50)
@given(st.text())
def test_any_text_fits_into_xml(text: str) -> None:
    element = etree.Element("a")
    element.text = xml_text(text)
    read = etree.fromstring(etree.tostring(element)).text or ""
    assert read.replace("\r", "\n") == xml_text(text).replace("\r", "\n")


def test_forbidden_characters_are_replaced_and_no_others() -> None:
    assert xml_text("a\x00b\x0bc\ud800d\ufffee") == "a\ufffdb\ufffdc\ufffdd\ufffde"
    assert xml_text("tab\tline\nü€𝄞\x85") == "tab\tline\nü€𝄞\x85"


@settings(deadline=None, max_examples=50)
@given(st.floats())
@example(-sys.float_info.max)
def test_a_float_written_twice_is_the_same(value: float) -> None:
    once = scalar(value)
    assert once is None or (isinstance(once, float) and scalar(once) == once and abs(once - value) <= 1e-9 * abs(value))


def test_keys_are_cleaned_too() -> None:
    assert scalars({"a\x00": 1, "b": float("inf")}) == {"a\ufffd": 1, "b": None}
