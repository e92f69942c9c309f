"""The widget in real JupyterLab, Notebook 7 and marimo, and in documents that nbconvert makes, in Chromium: arguments PROGRAMS SCREENSHOTS, then
those of unittest. It prints what it measures; nothing fails because a machine is slow."""
from __future__ import annotations

import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np

import pages
import servers
from pages import JupyterTab, Tab

PROGRAMS, SCREENSHOTS = (pathlib.Path(each).resolve() for each in sys.argv[1:3])
ROOT = pathlib.Path(__file__).resolve().parents[2]

# A body without symmetry.
LOAD = """import numpy as np
import slabstream as ss
z, y, x = np.mgrid[-1:1:96j, -1:1:96j, -1:1:96j]
array = np.uint8(255 * np.clip(1 - np.sqrt(x**2 + 2 * y**2 + 3 * z**2) + 0.6 * np.exp(-20 * ((x - 0.5) ** 2 + y**2 + z**2)), 0, 1))
volume = ss.load(array)"""
VIEW = "widget = volume.view(azimuth=30, elevation=20, height=600)\nwidget.layout.width = '560px'\nwidget"
BUSY = "import time\ntime.sleep(600)"
# As where a browser does not reach the kernel's machine.
KERNEL_ALONE = {"BINDER_SERVICE_HOST": "far.test"}


def note(text: str) -> None:
    print(f"    {text} (load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors)", flush=True)


class Browsed(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.driver = pages.browser.start(*map(shutil.which, ("chromium", "chromedriver")))
        cls.addClassCleanup(cls.driver.quit)

    def setUp(self) -> None:
        made = tempfile.TemporaryDirectory(prefix="slabstream-test-", ignore_cleanup_errors=True)
        self.addCleanup(made.cleanup)
        self.folder = pathlib.Path(made.name)
        self.environment = {"PYTHONPATH": str(ROOT / "python"), "PYTHONDONTWRITEBYTECODE": "1", "SLABSTREAM_PROGRAMS": str(PROGRAMS)}

    def serve(self, kind, *arguments, **environment: str):
        server = kind(self.folder, *arguments, **self.environment | environment)
        self.addCleanup(server.end)
        return server

    def tab(self, kind, *arguments):
        tab = kind(self.driver, *arguments)
        self.addCleanup(tab.close)
        return tab

    def notebook(self, *cells: str, **environment: str) -> JupyterTab:
        """In JupyterLab, with these cells run."""
        servers.notebook(self.folder / "a.ipynb", *cells, BUSY)
        self.lab = self.serve(servers.lab, **environment)
        tab = self.tab(JupyterTab, self.lab, "lab/tree/a.ipynb")
        self.run_all(tab, len(cells), "JupyterLab, over the kernel")
        return tab

    def run_all(self, tab: JupyterTab, count: int, what: str = "") -> None:
        """`what`: of the last cell, which is measured."""
        tab.wait_for_kernel()
        for number in range(count):
            began = tab.js("(drawn.length = 0, performance.now())")
            tab.run_cell(number)
            if number < count - 1:
                tab.has_run(number)
        tab.until("drawn.length > 0")
        if what:
            note(f"{what}: first picture {(tab.js('drawn[0].at') - began) / 1000:.2f} s after the cell was run")
        tab.has_run(count - 1)
        tab.final()

    def check_picture(self, tab: JupyterTab, name: str = "widget", viewer: int = 0) -> np.ndarray:
        """What the canvas shows is what Python says of it."""
        limit = time.monotonic() + pages.SECONDS
        while True:  # until the state has reached Python, or the page
            tab.final(viewer)
            pixels = tab.pixels(viewer)
            height, width = pixels.shape[:2]
            file = self.folder / "picture.npy"
            tab.ask(f"np.save('{file}', np.asarray({name}.picture(size=({width}, {height}))))")
            apart = np.abs(pixels.astype(int) - np.load(file)).max()
            if apart <= 1 or time.monotonic() > limit:  # 1: one of them rounds floats, the other what the service rounded
                break
        self.assertLessEqual(apart, 1, tab.ask(f"{name}.state"))
        self.assertGreater(pixels[..., 0].std(), 5)
        return pixels


class Kernel(Browsed):
    """Over the kernel's channel alone."""

    def test_it_turns_and_follows_python(self) -> None:
        tab = self.notebook(LOAD, VIEW, **KERNEL_ALONE)
        self.assertEqual(tab.ask("widget.channel"), "kernel")
        before = self.check_picture(tab)
        tab.drag(120, 40)
        tab.changed(before)
        turned = self.check_picture(tab)
        self.assertNotEqual(tab.ask("widget.camera.azimuth"), "30.0")
        tab.ask("[setattr(widget, 'camera', {'azimuth': a, 'elevation': 0}) for a in range(0, 91, 3)]")
        tab.changed(turned)
        moved = self.check_picture(tab)
        self.assertEqual(tab.ask("widget.camera.azimuth"), "90.0")
        tab.ask("setattr(widget, 'transfer', 'viridis')")
        tab.changed(moved)
        self.check_picture(tab)
        tab.save(SCREENSHOTS, "lab")
        note(f"over the kernel: {tab.pictures_a_second(5):.1f} pictures a second of {'x'.join(map(str, tab.pixels().shape[1::-1]))} while turning")

    def test_it_turns_while_a_cell_runs(self) -> None:
        """By the kernel's subshells."""
        tab = self.notebook(LOAD, VIEW, **KERNEL_ALONE)
        tab.run_cell(2)
        tab.until(f"{tab.SESSION}.session.kernel.status === 'busy'")
        before = tab.pixels()
        tab.drag(120, 40)
        tab.changed(before)
        self.assertIsNone(tab.js(f"{tab.PANEL}.content.widgets[2].model.executionCount"))

    def test_a_restarted_kernel_shows_it_again(self) -> None:
        tab = self.notebook(LOAD, VIEW, **KERNEL_ALONE)
        tab.driver.execute_async_script(f"const done = arguments[0]; {tab.SESSION}.restartKernel().then(() => done(1))")
        tab.wait_for_kernel()
        self.run_all(tab, 2)
        self.check_picture(tab)

    def test_two_tabs_show_the_same(self) -> None:
        one = self.notebook(LOAD, VIEW, **KERNEL_ALONE)
        one.driver.execute_async_script("const done = arguments[0]; jupyterapp.commands.execute('docmanager:save').then(() => done(1))")
        two = self.tab(JupyterTab, self.lab, "lab/workspaces/other/tree/a.ipynb")
        two.until("drawn.length > 0")
        two.final()
        first = self.check_picture(two)
        two.drag(100, 0)
        two.changed(first)
        second = self.check_picture(two)
        one.focus()
        np.testing.assert_array_equal(self.check_picture(one), second)

    def test_a_cell_that_runs_again_lets_go_of_its_volume(self) -> None:
        tab = self.notebook(LOAD, "widget = ss.view(array, azimuth=30, elevation=20, height=600)\nwidget", **KERNEL_ALONE)
        tab.run_cell(1)
        tab.has_run(1)
        self.assertEqual(tab.ask("len(volume.service.datasets())"), "2")
        self.check_picture(tab)

    def test_it_goes_on_after_a_silence(self) -> None:
        """As of a closed lid."""
        tab = self.notebook(LOAD, VIEW, **KERNEL_ALONE)
        os.killpg(self.lab.process.pid, signal.SIGSTOP)
        tab.until("performance.now() - drawn[drawn.length - 1].at > 9000")
        os.killpg(self.lab.process.pid, signal.SIGCONT)
        before = tab.js("drawn.length")
        tab.until(f"drawn.length > {before}")
        tab.drag(100, 0)
        self.check_picture(tab)

    def test_linked_widgets_move_together(self) -> None:
        second = "other = volume.view(height=400, transfer='viridis')\nimport traitlets\ntraitlets.link((widget, 'camera'), (other, 'camera'))\nother"
        tab = self.notebook(LOAD, VIEW, second, **KERNEL_ALONE)
        tab.until("canvases().length === 2")
        for viewer in (0, 1, 0):
            for number in (0, 1):
                tab.final(number)
            before = [tab.pixels(number) for number in (0, 1)]
            tab.drag(90, 30, viewer)
            for number, name in enumerate(("widget", "other")):
                tab.changed(before[number], number)
                self.check_picture(tab, name, number)
            self.assertEqual(tab.ask("widget.camera == other.camera"), "True")
        tab.save(SCREENSHOTS, "linked")

    def test_saved_notebooks_and_documents_show_a_picture(self) -> None:
        tab = self.notebook(LOAD, VIEW, **KERNEL_ALONE)
        still = "[...document.querySelectorAll('[class^=slabstream-still] img')].filter(i => i.naturalWidth === 512 && i.getBoundingClientRect().width > 100).length"
        tab.until(f"document.querySelector('[class^=slabstream-still]') !== null && {still} === 0")  # the live one hides it
        tab.driver.execute_async_script("const done = arguments[0]; jupyterapp.commands.execute('docmanager:save').then(() => done(1))")
        tab.driver.execute_async_script(f"const done = arguments[0]; {tab.SESSION}.shutdown().then(() => done(1))")
        again = self.tab(JupyterTab, self.lab, "lab/workspaces/again/tree/a.ipynb")
        again.until(f"{still} === 1")
        again.save(SCREENSHOTS, "saved")
        self.lab.end()
        subprocess.run([sys.executable, "-m", "nbconvert", "--to", "html", "a.ipynb"], cwd=self.folder, check=True, capture_output=True)
        document = self.tab(Tab, f"file://{self.folder}/a.html")
        document.until(f"{still} === 1")
        document.save(SCREENSHOTS, "nbconvert")


class Gateway(Browsed):
    """Straight from the gateway, on one machine."""

    def test_it_turns(self) -> None:
        servers.notebook(self.folder / "a.ipynb", LOAD, VIEW)
        self.lab = self.serve(servers.lab)
        tab = self.tab(JupyterTab, self.lab, "lab/tree/a.ipynb")
        self.run_all(tab, 2, "JupyterLab, from the gateway")
        self.assertEqual(tab.ask("widget.channel"), "gateway")
        before = self.check_picture(tab)
        tab.drag(120, 40)
        tab.changed(before)
        self.check_picture(tab)
        note(f"from the gateway: {tab.pictures_a_second(5):.1f} pictures a second of {'x'.join(map(str, tab.pixels().shape[1::-1]))} while turning")


class Others(Browsed):
    def test_notebook_7(self) -> None:
        servers.notebook(self.folder / "a.ipynb", LOAD, VIEW)
        tab = self.tab(JupyterTab, self.serve(servers.notebook7, **KERNEL_ALONE), "notebooks/a.ipynb")
        self.run_all(tab, 2, "Notebook 7, over the kernel")
        before = self.check_picture(tab)
        tab.drag(120, 40)
        tab.changed(before)
        self.check_picture(tab)
        tab.save(SCREENSHOTS, "notebook7")

    def test_marimo(self) -> None:
        cells = "\n\n".join(f"@app.cell\ndef _({given}):\n" + "\n".join(f"    {line}" for line in [*code.split("\n"), after])
                            for given, code, after in (("", LOAD, "return (volume,)"), ("volume", VIEW, "return")))
        (self.folder / "a.py").write_text(f"import marimo\n\napp = marimo.App()\n\n\n{cells}\n\n\nif __name__ == '__main__':\n    app.run()\n")
        for environment, channel in (({}, "gateway"), (KERNEL_ALONE, "kernel")):
            server = self.serve(servers.marimo, "a.py", **environment)
            tab = self.tab(Tab, f"{server.url}/?access_token={server.token}")
            button = "[...document.querySelectorAll('[data-testid=run-button]')].filter(b => !b.className.includes('inactive')).pop()"
            tab.until(f"!!{button}")  # of the last cell; those that it needs run, too
            tab.js(f"({button}.click(), 1)")
            tab.until("drawn.length > 0")
            tab.final()
            before = tab.pixels()
            tab.drag(120, 40)
            tab.changed(before)
            tab.save(SCREENSHOTS, f"marimo-{channel}")
            note(f"marimo, {channel}: {tab.pictures_a_second(5):.1f} pictures a second of {'x'.join(map(str, tab.pixels().shape[1::-1]))} while turning")
            server.end()


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
