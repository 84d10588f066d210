"""A notebook as a person uses it: in JupyterLab, in a browser, with a mouse."""

import importlib.util
import json
import os
import socket
import subprocess
import sys
import time
from pathlib import Path
from urllib.request import urlopen

import pytest
from browsers import browser, complaints, is_missing, wait_for
from selenium.webdriver import ActionChains
from selenium.webdriver.common.by import By

if importlib.util.find_spec("jupyterlab") is None:
    is_missing("JupyterLab, of the extra browser,")

pytestmark = pytest.mark.of_checkout("it runs the checkout's notebooks")

NOTEBOOK = Path(__file__).parents[1] / "notebooks" / "explore_warps.ipynb"
SHELL = "window.jupyterapp.shell"
# The current widget is another where anything else on the page has the focus.
OPEN = f"[...{SHELL}.widgets('main')].find((of) => of.context?.path === 'sliders.ipynb')"
PICTURES = "[...document.querySelectorAll('.jp-OutputArea-output img')].map((of) => of.src).join()"
IS_IDLE = f"{OPEN}.sessionContext.session.kernel.status === 'idle'"
READOUT = ".widget-readout"
# JupyterLab asks nothing over the notebook: neither whether an extension that another package has
# brought is to be built into it, in a dialog that takes the focus, nor whether there is to be news.
PAGE_CONFIG = {
    "buildCheck": False,
    "disabledExtensions": {"@jupyterlab/apputils-extension:announcements": True},
}


@pytest.fixture
def notebook(tmp_path):
    """The address of a notebook up to its first sliders, without outputs, in JupyterLab."""
    content = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    texts = ["".join(cell["source"]) for cell in content["cells"]]
    end = 1 + next(i for i, text in enumerate(texts) if "interact(" in text)
    content["cells"] = content["cells"][:end]
    for cell in content["cells"]:
        if cell["cell_type"] == "code":
            cell.update(outputs=[], execution_count=None)
    (tmp_path / "sliders.ipynb").write_text(json.dumps(content), encoding="utf-8")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"http://127.0.0.1:{free.getsockname()[1]}"
    command = [
        *(sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root"),
        *(f"--port={address.rpartition(':')[2]}", "--IdentityProvider.token=tested"),
        "--LabApp.expose_app_in_browser=True",
    ]
    # Nothing of the user's own is read or written.
    own = {f"JUPYTER_{kind}_DIR": str(tmp_path / kind) for kind in ("CONFIG", "RUNTIME")}
    page_config = tmp_path / "CONFIG" / "labconfig" / "page_config.json"
    page_config.parent.mkdir(parents=True)
    page_config.write_text(json.dumps(PAGE_CONFIG), encoding="utf-8")
    with (
        (tmp_path / "log").open("w") as log,
        subprocess.Popen(
            command, cwd=tmp_path, env={**os.environ, **own}, stdout=log, stderr=log
        ) as server,
    ):
        try:
            wait_until_it_answers(f"{address}/api", server)
            yield f"{address}/lab/tree/sliders.ipynb?token=tested"
        finally:
            server.terminate()


def wait_until_it_answers(address, server, seconds=60.0):
    end = time.monotonic() + seconds
    while True:
        try:
            urlopen(address).close()
        except OSError:
            assert server.poll() is None
            assert time.monotonic() < end
            time.sleep(0.2)
        else:
            return


def test_a_slider_changes_the_pictures(notebook, tmp_path):
    with browser(1500, 1100) as page:
        page.get(notebook)
        wait_for(page, f"{OPEN}.context.isReady && {OPEN}.sessionContext.isReady")
        assert [of.text for of in page.find_elements(By.CSS_SELECTOR, ".jp-Dialog")] == []
        page.execute_script(f"{SHELL}.activateById({OPEN}.id)")
        wait_for(page, f"{SHELL}.currentWidget === {OPEN}")
        page.execute_script("window.jupyterapp.commands.execute('notebook:run-all-cells')")
        before = wait_for(page, PICTURES)
        value = page.find_element(By.CSS_SELECTOR, READOUT).text
        handle = page.find_element(By.CSS_SELECTOR, ".noUi-handle")
        ActionChains(page).drag_and_drop_by_offset(handle, 40, 0).perform()
        # Between two pictures there is none; a drag makes several, one after the other.
        changes = f"{PICTURES} !== {json.dumps(before)}"
        assert wait_for(page, f"{IS_IDLE} && {changes} && {PICTURES}")
        assert float(page.find_element(By.CSS_SELECTOR, READOUT).text) > 2 * float(value)
        words = page.execute_script(f"return {OPEN}.node.innerText")
        assert "Rows and columns: rtw" in words
        assert "Error" not in words
        picture = page.find_element(By.CSS_SELECTOR, ".jp-OutputArea-output img")
        page.execute_script("arguments[0].scrollIntoView({block: 'end'})", picture)
        width = page.execute_script("return arguments[0].naturalWidth", picture)
        assert width > 1000  # it is shown: 18 inches
        assert page.save_screenshot(str(tmp_path / "notebook.png"))
        assert complaints(page) == []
