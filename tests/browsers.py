"""Chromium without a window, for the tests that need a real browser."""

from __future__ import annotations

import importlib.util
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NoReturn

import pytest


def is_missing(what: str) -> NoReturn:
    """Skips the test, and says so; where LIXEL_BROWSER is set it fails."""
    words = f"{what} is not installed; LIXEL_BROWSER=1 make test does it"
    assert not os.environ.get("LIXEL_BROWSER"), words
    pytest.skip(words, allow_module_level=True)


if importlib.util.find_spec("selenium") is None:
    is_missing("selenium, of the extra browser,")

from selenium.webdriver import Chrome, ChromeOptions, ChromeService  # noqa: E402
from selenium.webdriver.support.ui import WebDriverWait  # noqa: E402

BROWSERS = ("chromium", "chromium-browser", "google-chrome")


@contextmanager
def browser(width: int = 1280, height: int = 900) -> Iterator[Chrome]:
    """A page of its own."""
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    driver = shutil.which("chromedriver")
    if program is None or driver is None:
        is_missing("Chromium, or chromedriver,")
    options = ChromeOptions()
    options.binary_location = program
    # Without a sandbox, so that root can run it; it sees nothing but the test's own pages.
    for argument in ("headless=new", "no-sandbox", "disable-gpu", "disable-dev-shm-usage"):
        options.add_argument(f"--{argument}")
    options.add_argument(f"--window-size={width},{height}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    chrome = Chrome(options, ChromeService(driver))
    try:
        yield chrome
    finally:
        chrome.quit()


def wait_for(chrome: Chrome, condition: str, seconds: float = 60.0) -> object:
    """What an expression of JavaScript is, once it is true."""
    # A page that is still being made has no such names.
    script = f"try {{ return {condition} }} catch {{ return null }}"
    return WebDriverWait(chrome, seconds).until(lambda page: page.execute_script(script))


def complaints(chrome: Chrome) -> list[str]:
    """What the console shows in red."""
    return [entry["message"] for entry in chrome.get_log("browser") if entry["level"] == "SEVERE"]
