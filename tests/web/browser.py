"""Chromium through chromedriver, and the viewer's page in it."""
import base64
import json
import time

from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By

TIMEOUT = 60  # far above what anything needs
FLAGS = ("--no-sandbox", "--headless=new", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync", "--js-flags=--expose-gc", "--enable-precise-memory-info", "--window-size=1000,720")

# Runs before the page: keeps what tests ask about.
WATCH = """
window.drawn = []; window.violations = []; window.copied = [];
document.addEventListener('slabstream:drawn', e => { window.drawn.push(e.detail); if (window.drawn.length > 400) window.drawn.shift(); });
document.addEventListener('securitypolicyviolation', e => window.violations.push(e.blockedURI + ' ' + e.violatedDirective));
if (navigator.clipboard) navigator.clipboard.writeText = async text => { window.copied.push(text); };
"""


def start(chromium, chromedriver):
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for flag in FLAGS:
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(service=Service(chromedriver), options=options)
    driver.set_script_timeout(TIMEOUT)
    return driver


class Viewer:
    """A tab with the page. `script` runs before it."""

    def __init__(self, driver, url, width=1000, height=640, pixels=1, mobile=False, theme="dark", script=""):
        self.driver = driver
        driver.switch_to.new_window("tab")
        self.handle = driver.current_window_handle
        self.command("Page.addScriptToEvaluateOnNewDocument", source=WATCH + script)
        self.command("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=pixels, mobile=mobile)
        self.command("Emulation.setTouchEmulationEnabled", enabled=mobile)
        self.theme(theme)
        driver.get(url)

    def command(self, name, **parameters):
        return self.driver.execute_cdp_cmd(name, parameters)

    def theme(self, name, motion="no-preference"):
        self.command("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": name}, {"name": "prefers-reduced-motion", "value": motion}])

    def focus(self):
        self.driver.switch_to.window(self.handle)

    def close(self):
        self.focus()
        self.driver.close()
        self.driver.switch_to.window(self.driver.window_handles[0])

    def js(self, expression, *arguments):
        return self.driver.execute_script("return " + expression, *arguments)

    def until(self, expression, *arguments):
        """Waits until a JavaScript expression is true, and gives its value."""
        limit = time.monotonic() + TIMEOUT
        while not (value := self.js(expression, *arguments)):
            if time.monotonic() > limit:
                raise AssertionError(f"never true: {expression}; last drawn {self.js('JSON.stringify(window.drawn.slice(-1))')}; says {self.js('document.body.innerText.slice(0, 400)')}")
            time.sleep(0.02)
        return value

    def drawn(self, pane="3d"):
        """The last picture of a pane: {"header", "seq", "final", "options", ...}."""
        return self.js("window.drawn.filter(d => d.pane === arguments[0]).pop()", pane)

    def final(self, condition="true", pane="3d"):
        """The next or present lossless picture whose options `o` fulfil a condition."""
        return self.until(f"(() => {{ const d = window.drawn.filter(d => d.pane === arguments[0]).pop(); if (!d || !d.final) return null; const o = d.options, h = d.header; return ({condition}) ? d : null; }})()", pane)

    def settled(self, pane="3d"):
        """The lossless picture of the page's present state."""
        self.until("document.querySelector('[data-pane=\"3d\"] canvas') !== null")
        if pane == "3d":
            return self.final("o['look-at'] !== undefined", pane)
        return self.final("true", pane)

    def canvas(self, pane="3d"):
        return self.driver.find_element(By.CSS_SELECTOR, f'[data-pane="{pane}"] canvas')

    def pixels(self, pane="3d", root="document"):
        """Width, height and RGBA bytes of what the canvas shows. `root`: in which it is, as JavaScript."""
        width, height, text = self.js("""(() => { const c = ROOT.querySelector(`[data-pane="${arguments[0]}"] canvas`), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
            let s = ''; for (let i = 0; i < d.length; i += 32768) s += String.fromCharCode(...d.subarray(i, i + 32768)); return [c.width, c.height, btoa(s)]; })()""".replace("ROOT", root), pane)
        return width, height, base64.b64decode(text)

    def find(self, selector):
        return self.driver.find_element(By.CSS_SELECTOR, selector)

    def open_section(self, title):
        self.js("(() => { const d = [...document.querySelectorAll('details')].find(d => d.querySelector('h2').textContent === arguments[0]); d.open = true; d.scrollIntoView(); return true; })()", title)

    def actions(self):
        return ActionChains(self.driver, duration=20)

    def drag(self, dx, dy, start=(0, 0), button="left", keys=(), pane="3d", steps=4):
        """In the middle of a pane, or from there by `start`. Real events of the browser."""
        box = self.js("(b => [b.left + b.width / 2, b.top + b.height / 2])(document.querySelector(`[data-pane=\"${arguments[0]}\"] canvas`).getBoundingClientRect())", pane)
        x, y = box[0] + start[0], box[1] + start[1]
        modifiers = sum({"alt": 1, "ctrl": 2, "meta": 4, "shift": 8}[key] for key in keys)
        held = {"left": 1, "right": 2, "middle": 4}[button]
        mouse = lambda kind, px, py, pressed=True: self.command("Input.dispatchMouseEvent", type=kind, x=px, y=py, button=button, buttons=held if pressed else 0, modifiers=modifiers, clickCount=1)
        mouse("mousePressed", x, y)
        for step in range(1, steps + 1):
            mouse("mouseMoved", x + dx * step / steps, y + dy * step / steps)
        mouse("mouseReleased", x + dx, y + dy, False)

    def wheel(self, delta, offset, pane="3d"):
        box = self.js("(b => [b.left + b.width / 2, b.top + b.height / 2])(document.querySelector(`[data-pane=\"${arguments[0]}\"] canvas`).getBoundingClientRect())", pane)
        self.command("Input.dispatchMouseEvent", type="mouseWheel", x=box[0] + offset[0], y=box[1] + offset[1], deltaX=0, deltaY=delta)

    def hover(self, offset, pane="3d"):
        box = self.js("(b => [b.left + b.width / 2, b.top + b.height / 2])(document.querySelector(`[data-pane=\"${arguments[0]}\"] canvas`).getBoundingClientRect())", pane)
        self.command("Input.dispatchMouseEvent", type="mouseMoved", x=box[0] + offset[0], y=box[1] + offset[1])

    def touch(self, *fingers, steps=4):
        """Fingers that move from (x, y) to (x, y), from the middle of the picture."""
        box = self.js("(b => [b.left + b.width / 2, b.top + b.height / 2])(document.querySelector('[data-pane=\"3d\"] canvas').getBoundingClientRect())")
        at = lambda share: [{"x": box[0] + a[0] + (b[0] - a[0]) * share, "y": box[1] + a[1] + (b[1] - a[1]) * share, "id": i} for i, (a, b) in enumerate(fingers)]
        self.command("Input.dispatchTouchEvent", type="touchStart", touchPoints=at(0))
        for step in range(1, steps + 1):
            self.command("Input.dispatchTouchEvent", type="touchMove", touchPoints=at(step / steps))
        self.command("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def keys(self, *keys, pane="3d"):
        self.canvas(pane).send_keys(*keys)

    def save(self, folder, name):
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{name}.png").write_bytes(base64.b64decode(self.command("Page.captureScreenshot", format="png")["data"]))

    def log(self):
        return [json.dumps(entry) for entry in self.driver.get_log("browser")]
