"""The page of an orientation in a real browser: it loads without a complaint, says what was found on its first screen, and nothing sticks out."""

from __future__ import annotations

from pathlib import Path

from browser.chromium import Chromium
from reporting.test_orientation_report import images, pages, refinement


def test_it_answers_on_its_first_screen_and_its_map_shows_all_images(browser: Chromium, tmp_path: Path) -> None:
    pages(tmp_path, refinement())
    browser.messages.clear()
    browser.open((tmp_path / "orientation.html").as_uri())
    assert browser.messages == []
    seen = browser.run(
        "[...document.querySelectorAll('.short dd')].map(d => d.getBoundingClientRect().bottom < innerHeight)"
    )
    assert seen == [True, True, True]
    assert "12 of 13 images have a pose" in browser.run("document.querySelector('header').innerText")
    inside = browser.run(
        "(m => [...document.querySelectorAll('.stations circle')].filter(c => (r => r.left >= m.left && r.right <= m.right && r.top >= m.top"
        " && r.bottom <= m.bottom)(c.getBoundingClientRect())).length)(document.querySelector('.stations').getBoundingClientRect())"
    )
    assert inside == len(images())
    assert browser.run("getComputedStyle(document.querySelector('.stations .weak circle')).fill") == "rgb(200, 49, 58)"
    assert browser.run("document.documentElement.scrollWidth <= innerWidth")
