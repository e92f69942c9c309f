"""Notebooks in Chromium: a tab, the viewers in it, and what their canvases hold."""
from __future__ import annotations

import base64
import pathlib
import sys
import time

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "web"))
import browser  # noqa: E402

SECONDS = 90  # far above what anything needs

WATCH = """
window.drawn = [];
addEventListener('slabstream:drawn', e => { if (e.detail.pane === '3d') window.drawn.push({at: performance.now(), final: e.detail.final, canvas: e.composedPath()[0]}); }, true);
window.canvases = (root = document) => [...root.querySelectorAll('*')].flatMap(e => [...(e.matches('[data-pane="3d"] canvas') ? [e] : []), ...(e.shadowRoot ? canvases(e.shadowRoot) : [])]);
window.pixelsOf = c => { const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; let s = '';
  for (let i = 0; i < d.length; i += 32768) s += String.fromCharCode(...d.subarray(i, i + 32768)); return [c.width, c.height, btoa(s)]; };
"""


class Tab:
    def __init__(self, driver, url: str):
        self.driver = driver
        driver.switch_to.new_window("tab")
        self.handle = driver.current_window_handle
        self.command("Page.addScriptToEvaluateOnNewDocument", source=WATCH)
        self.command("Emulation.setDeviceMetricsOverride", width=1200, height=1100, deviceScaleFactor=1, mobile=False)
        self.command("Emulation.setFocusEmulationEnabled", enabled=True)
        driver.get(url)

    def command(self, name: str, **parameters):
        return self.driver.execute_cdp_cmd(name, parameters)

    def focus(self) -> None:
        self.driver.switch_to.window(self.handle)

    def close(self) -> None:
        self.focus()
        self.driver.close()
        self.driver.switch_to.window(self.driver.window_handles[0])

    def js(self, expression: str, *arguments):
        return self.driver.execute_script(f"return {expression}", *arguments)

    def until(self, expression: str, *arguments, seconds: float = SECONDS):
        """Waits until a JavaScript expression is true, and gives its value."""
        limit = time.monotonic() + seconds
        while not (value := self.js(expression, *arguments)):
            if time.monotonic() > limit:
                raise AssertionError(f"never true: {expression}; the page says {self.js('document.body.innerText.slice(-1500)')}")
            time.sleep(0.01)
        return value

    def save(self, folder: pathlib.Path, name: str) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{name}.png").write_bytes(base64.b64decode(self.command("Page.captureScreenshot", format="png")["data"]))

    # ---- viewers, by their order in the page

    def final(self, viewer: int = 0) -> None:
        """Its last picture is lossless: the view stands still."""
        self.until("(() => { const c = canvases()[arguments[0]], d = c && drawn.filter(d => d.canvas === c).pop(); return d && d.final; })()", viewer)

    def pixels(self, viewer: int = 0) -> np.ndarray:
        width, height, text = self.js("pixelsOf(canvases()[arguments[0]])", viewer)
        return np.frombuffer(base64.b64decode(text), np.uint8).reshape(height, width, 4)

    def changed(self, before: np.ndarray, viewer: int = 0) -> None:
        """Its lossless picture is another one than before."""
        limit = time.monotonic() + SECONDS
        while True:
            self.final(viewer)
            apart = np.abs(self.pixels(viewer).astype(int) - before).mean()
            if apart > 0.1:  # a lossless picture of the same view differs by 0
                return
            if time.monotonic() > limit:
                raise AssertionError(f"the picture stays as it is: pixels differ by {apart:.3f} on average")
            time.sleep(0.05)

    def _middle(self, viewer: int) -> tuple[float, float]:
        """Of its canvas, on the screen."""
        return self.js("(c => { c.scrollIntoView({block: 'center'}); const b = c.getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2]; })(canvases()[arguments[0]])", viewer)

    def _mouse(self, kind: str, x: float, y: float, pressed: int = 1) -> None:
        self.command("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=pressed, clickCount=1)

    def drag(self, dx: float, dy: float, viewer: int = 0) -> None:
        x, y = self._middle(viewer)
        self._mouse("mousePressed", x, y)
        for step in range(1, 6):
            self._mouse("mouseMoved", x + dx * step / 5, y + dy * step / 5)
        self._mouse("mouseReleased", x + dx, y + dy, 0)

    def click(self, viewer: int = 0) -> None:
        x, y = self._middle(viewer)
        self._mouse("mouseMoved", x, y, 0)
        self._mouse("mousePressed", x, y)
        self._mouse("mouseReleased", x, y, 0)

    def pictures_a_second(self, seconds: float, viewer: int = 0) -> float:
        """While the mouse turns it: moves by the page itself, each 10 ms, since chromedriver is slow."""
        x, y = self._middle(viewer)
        self._mouse("mousePressed", x, y)
        turn = """const [viewer, x, y, seconds, done] = arguments, c = canvases()[viewer]; let n = 0;
            drawn.length = 0; const began = performance.now();
            const timer = setInterval(() => {
              c.dispatchEvent(new PointerEvent('pointermove', {bubbles: true, composed: true, pointerId: 1, pointerType: 'mouse', buttons: 1, isPrimary: true, clientX: x + 200 * Math.sin(++n / 40), clientY: y}));
              if (performance.now() - began > 1000 * seconds) { clearInterval(timer); done(drawn.filter(d => d.canvas === c).length / seconds); }
            }, 10);"""
        rate = self.driver.execute_async_script(turn, viewer, x, y, seconds)
        self._mouse("mouseReleased", x, y, 0)
        return rate


class JupyterTab(Tab):
    """A notebook in JupyterLab or Notebook 7. `path`: "lab/tree/a.ipynb" or "notebooks/a.ipynb"."""

    PANEL = "[...jupyterapp.shell.widgets('main')].find(w => w.sessionContext)"
    SESSION = f"{PANEL}.sessionContext"

    def __init__(self, driver, server, path: str):
        super().__init__(driver, f"{server.url}/{path}?token={server.token}")
        self.until(f"window.jupyterapp && {self.PANEL}?.sessionContext.isReady === true")
        self.js(f"jupyterapp.shell.activateById({self.PANEL}.id)")

    def wait_for_kernel(self) -> None:
        self.until(f"{self.SESSION}.session?.kernel?.status === 'idle'")

    def run_cell(self, number: int) -> None:
        self.driver.execute_script(f"{self.PANEL}.content.activeCellIndex = {number}; jupyterapp.commands.execute('notebook:run-cell')")

    def has_run(self, number: int) -> None:
        cell = f"{self.PANEL}.content.widgets[{number}].model"
        self.until(f"{cell}.executionCount !== null && {self.SESSION}.session.kernel.status === 'idle'")
        errors = self.js(f"{cell}.sharedModel.getOutputs().filter(o => o.output_type === 'error').map(o => o.ename + ': ' + o.evalue)")
        assert not errors, errors

    def ask(self, expression: str) -> str:
        """What the kernel prints for a Python expression."""
        ask = """const [session, code, done] = arguments; let said = '';
            const future = eval(session).session.kernel.requestExecute({code, silent: false, store_history: false});
            future.onIOPub = m => { said += m.content.text ?? m.content.evalue ?? ''; }; future.done.then(() => done(said));"""
        return self.driver.execute_async_script(ask, self.SESSION, f"print(end=str({expression}))")
