"""`lixel view` as a person uses it: in a browser, with a mouse."""

import base64
import io
import re
import subprocess
import sys

import numpy as np
import pytest
from browsers import browser, complaints, wait_for
from PIL import Image
from selenium.webdriver import ActionChains, Keys
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import Select

# The page is at rest: the picture of the last view is shown, and its maps.
RESTS = "isStill && !isDirty && lastShown === lastAsked && !element('shadow').hidden"


@pytest.fixture(scope="module")
def address():
    """That of a viewer in a process of its own."""
    command = [sys.executable, "-m", "lixel", "view", "plane_and_box", "--no-browser"]
    command += ["--device", "cpu"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process.stdout.readline().strip()
        finally:
            process.terminate()


@pytest.fixture(scope="module")
def page(address):
    with browser() as chrome:
        chrome.get(address)
        wait_for(chrome, "lastShown > 0")
        yield chrome


def picture(page):
    """What the canvas shows."""
    text = page.execute_script("return canvas.toDataURL('image/png')")
    image = Image.open(io.BytesIO(base64.b64decode(text.partition(",")[2])))
    return np.asarray(image.convert("RGB")).astype(int)


def drag(page, across, down, key=None):
    """From the middle of the picture, in steps, with a key held down."""
    actions = ActionChains(page, duration=50)
    if key:
        actions.key_down(key)
    actions.move_to_element(page.find_element(By.ID, "view")).click_and_hold()
    for _ in range(5):
        actions.move_by_offset(across // 5, down // 5)
    actions.release()
    if key:
        actions.key_up(key)
    actions.perform()


def misclassified(page):
    row = wait_for(page, f"{RESTS} && element('numbers').textContent.match(/reference([0-9]+)/)")
    return int(row[1])


def test_a_page_without_the_token_shows_nothing(address):
    with browser() as chrome:
        chrome.get(re.sub(r"token=.*", "token=guessed", address))
        assert chrome.find_elements(By.ID, "view") == []


def test_dragging_with_shift_turns_the_sun(page, tmp_path):
    for name, choice in (("method", "uniform"), ("resolution", "64²"), ("lookup", "depth")):
        Select(page.find_element(By.ID, name)).select_by_visible_text(choice)
    page.find_element(By.ID, "wrong").click()
    wrong, before = misclassified(page), picture(page)
    assert wrong > 0
    sun, eye = page.execute_script("return [light.direction, camera.eye]")
    map_before = page.execute_script("return element('shadow').querySelector('img').src")
    drag(page, 250, 40, Keys.SHIFT)
    wait_for(page, f"{RESTS} && element('shadow').querySelector('img').src !== {map_before!r}")
    now, eye_now = page.execute_script("return [light.direction, camera.eye]")
    assert np.dot(sun, now) / (np.linalg.norm(sun) * np.linalg.norm(now)) < 0.99
    assert eye_now == eye
    after = picture(page)
    # The shadow moved, what is behind the scene did not.
    differs = np.abs(after - before).max(axis=-1) > 40
    assert 0.005 < differs.mean() < 0.5
    assert misclassified(page) != wrong
    assert (after[..., 0] - after[..., 1] > 80).any()  # red
    file = tmp_path / "viewer.png"
    assert page.save_screenshot(str(file))
    assert np.asarray(Image.open(file)).std() > 20
    assert complaints(page) == []


def test_dragging_turns_the_camera(page):
    sun, eye, before = *page.execute_script("return [light.direction, camera.eye]"), picture(page)
    drag(page, 200, 0)
    wait_for(page, f"{RESTS} && camera.eye[0] !== {eye[0]!r}")
    assert page.execute_script("return light.direction") == sun
    assert (np.abs(picture(page) - before).max(axis=-1) > 40).mean() > 0.05
    assert complaints(page) == []
