#!/usr/bin/env python3
"""The npm package of <slab-view> as others use it: made, unpacked, checked by the compiler, and in Chromium on a site that is not the gateway's.

    package_test.py FOLDER_OF_PROGRAMS FOLDER_FOR_SCREENSHOTS CHROMIUM CHROMEDRIVER [unittest arguments]
"""
import functools
import http.server
import json
import os
import shutil
import subprocess
import sys
import tarfile
import threading
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "gateway"))
from gateway_test import Programs, wait_until  # noqa: E402
from page import png_pixels  # noqa: E402

import browser  # noqa: E402
from browser import Viewer  # noqa: E402

SHOTS, CHROMIUM, CHROMEDRIVER = Path(sys.argv[2]), sys.argv[3], sys.argv[4]
ROOT = HERE.parents[1]
NODE = Path("/usr/share/nodejs")  # where Debian has modules for node
SITE = "127.0.0.2"  # pages of 127.0.0.1 may ask every gateway

WATCH = """
window.told = [];
for (const type of ['slab-state', 'slab-pick', 'slab-error']) document.addEventListener(type, e => told.push({type, detail: e.detail}));
"""

# What the compiler must take, and what it must not.
PLAIN = """import "slabstream-view";
import type { SlabViewState } from "slabstream-view";
const view = document.createElement("slab-view");
view.state = { dataset: "head", azimuth: 30, "sampling-rate": 2 };
const azimuth: string | undefined = view.state.azimuth, parameter: string | undefined = view.state["sampling-rate"];
view.addEventListener("slab-state", ({ detail }) => { const state: SlabViewState = detail; console.log(state.zoom, azimuth, parameter); });
document.body.addEventListener("slab-pick", ({ detail }) => console.log(detail.at?.[2].toFixed(), detail.label?.name.trim()));
view.addEventListener("slab-error", ({ detail }) => console.log(detail.trim()));
// @ts-expect-error
view.state = { azimuth: [30] };
// @ts-expect-error
view.addEventListener("slab-pick", ({ detail }) => console.log(detail.nothing));
"""
APP = """import { useState } from "react";
import { createRoot } from "react-dom/client";
import type { SlabViewSettings } from "slabstream-view";
import { Volume } from "./react.js";

function App({ src, token }: { src: string; token: string }) {
  const [state, setState] = useState<SlabViewSettings>({ dataset: "sphere", azimuth: 200 }), [value, setValue] = useState<number | null>();
  return <>
    <button onClick={() => setState({ ...state, azimuth: 80 })}>Turn</button>
    <Volume src={src} token={token} state={state} onState={setState} onPick={pick => setValue(pick.value)} style={{ height: "400px" }} />
    <p id="azimuth">{state.azimuth}</p><p id="value">{value}</p>
  </>;
}
// @ts-expect-error
export const wrong = <slab-view azimuth={[30]} />;

const [src = "", token = ""] = decodeURIComponent(location.hash.slice(1)).split(" ");
createRoot(document.getElementById("app") as HTMLElement).render(<App src={src} token={token} />);
"""
PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>React</title><div id="app"></div>
<script type="module" src="app.js"></script></html>"""


class Files(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


class NoGateway(http.server.BaseHTTPRequestHandler):
    """Answers with errors, as a proxy does whose gateway is down."""

    def log_message(self, *_):
        pass


class PackageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.programs = Programs()
        cls.addClassCleanup(cls.programs.close)
        cls.folder = cls.programs.folder / "site"
        cls.folder.mkdir()
        environment = {**os.environ, "SOURCE_DATE_EPOCH": "1764450000"}
        made = []
        for name in ("one", "two"):
            subprocess.run([ROOT / "deploy/npm", cls.programs.folder / name], env=environment, check=True, stdout=subprocess.PIPE)
            made += (cls.programs.folder / name).iterdir()
        cls.archives = [path.read_bytes() for path in made]
        with tarfile.open(made[0]) as archive:
            archive.extractall(cls.folder)
        (cls.folder / "package.json").write_text('{"type": "module"}')
        modules = cls.folder / "node_modules"
        modules.mkdir()
        (modules / "slabstream-view").symlink_to(cls.folder / "package")

        cls.site = cls.serve(SITE, functools.partial(Files, directory=str(cls.folder)))

        cls.programs.run("sphere", "--class", 1, "--size", 24, "--occupancy", 0.2, "-o", "s.nrrd")
        _, endpoint = cls.programs.up("--data", "sphere=s.nrrd")
        _, cls.gateway = cls.programs.gateway("--endpoint", endpoint, "--origin", cls.site)
        _, cls.closed = cls.programs.gateway("--endpoint", endpoint)
        for gateway in (cls.gateway, cls.closed):
            wait_until(lambda: gateway.request("/readyz")[0] == 200, "ready")
        cls.driver = browser.start(CHROMIUM, CHROMEDRIVER)
        cls.addClassCleanup(cls.driver.quit)

    @classmethod
    def serve(cls, host, handler):
        """The address of a web server."""
        server = http.server.ThreadingHTTPServer((host, 0), handler)
        cls.addClassCleanup(server.server_close)
        cls.addClassCleanup(server.shutdown)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        return f"http://{host}:{server.server_port}"

    def open(self, address):
        tab = Viewer(self.driver, f"{self.site}/{address}", script=WATCH)
        self.addCleanup(tab.close)
        return tab

    def final(self, tab, condition="true"):
        """The lossless picture whose options `o` fulfil a condition; its pixels are those of the gateway's picture."""
        drawn = tab.final(f"o['look-at'] && ({condition})")
        status, _, data = self.gateway.request("/api/v1/render.png", method="POST", body=json.dumps(drawn["options"]))
        self.assertEqual(status, 200)
        width, height, pixels = tab.pixels(root="document.querySelector('slab-view').shadowRoot")
        self.assertTrue((width, height, pixels) == png_pixels(data), "the pixels are those of the gateway")
        self.assertGreater(len({pixels[i:i + 4] for i in range(0, len(pixels), 4)}), 100, "there is something to see")

    def place(self, tab):
        """The middle of the picture."""
        box = "document.querySelector('slab-view').shadowRoot.querySelector('canvas').getBoundingClientRect()"
        return tab.js(f"(b => [b.left + b.width / 2, b.top + b.height / 2])({box})")

    def mouse(self, tab, kind, x, y):
        buttons = 1 if kind == "mouseMoved" else 0
        tab.command("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=buttons, clickCount=1)

    def click(self, tab):
        x, y = self.place(tab)
        for kind in ("mousePressed", "mouseReleased"):
            self.mouse(tab, kind, x, y)

    def drag(self, tab, dx):
        x, y = self.place(tab)
        for kind, step in (("mousePressed", 0), ("mouseMoved", dx / 2), ("mouseMoved", dx), ("mouseReleased", dx)):
            self.mouse(tab, kind, x + step, y)

    def compile(self, *files, **options):
        tsc = shutil.which("tsc")
        if not tsc:
            self.skipTest("tsc is missing (Debian package node-typescript)")
        options = {"noEmit": True, "strict": True, "exactOptionalPropertyTypes": True, "target": "es2021", "module": "node16", "types": [], **options}
        (self.folder / "tsconfig.json").write_text(json.dumps({"compilerOptions": options, "files": files}))
        done = subprocess.run([tsc, "-p", "tsconfig.json"], cwd=self.folder, stdout=subprocess.PIPE, text=True)
        # Debian's types of React lack some that they name.
        self.assertEqual([line for line in done.stdout.splitlines() if str(NODE) not in line], [])

    def needs_react(self):
        if not (NODE / "react-dom").exists():
            self.skipTest("React is missing (Debian package node-react-dom)")
        source = self.folder / "app"
        if not source.exists():
            source.mkdir()
            (source / "app.tsx").write_text(APP)
            (source / "index.html").write_text(PAGE)
            shutil.copy(self.folder / "package/example/react.tsx", source)
            for name in ("@types", "react", "react-dom"):
                (self.folder / "node_modules" / name).symlink_to(NODE / name)

    def test_the_same_sources_make_the_same_package(self):
        self.assertTrue(self.archives[0] == self.archives[1])
        package = json.loads((self.folder / "package/package.json").read_text())
        self.assertRegex(package["version"], r"^\d+\.\d+\.\d+$")
        for entry in package["exports"].values():
            for path in entry.values():
                self.assertTrue((self.folder / "package" / path).is_file(), path)

    def test_the_compiler_knows_the_element(self):
        (self.folder / "plain.ts").write_text(PLAIN)
        self.compile("plain.ts")

    def test_the_compiler_knows_the_element_in_react(self):
        self.needs_react()
        self.compile("app/app.tsx", "app/react.tsx", jsx="react-jsx")

    def test_a_server_that_renders_pages_can_import_it(self):
        node = shutil.which("node")
        if not node:
            self.skipTest("node is missing")
        (self.folder / "server.mjs").write_text('import "slabstream-view";\n')
        subprocess.run([node, "server.mjs"], cwd=self.folder, check=True)

    def test_the_page_shows_it_on_another_site(self):
        tab = self.open(f"package/example/?http://127.0.0.1:{self.gateway.port}/#token={self.gateway.token}")
        self.final(tab)
        self.click(tab)
        picked = tab.until("told.find(t => t.type === 'slab-pick')")["detail"]
        self.assertEqual((picked["hit"], picked["inside"]), (True, True))
        tab.js("(told.length = 0, true)")
        self.drag(tab, 40)
        self.final(tab, "o.azimuth !== 30")
        azimuth = tab.js("document.querySelector('slab-view').state.azimuth")
        tab.until("told.some(t => t.type === 'slab-state' && t.detail.azimuth === arguments[0])", azimuth)
        self.assertIn(azimuth, tab.js("document.getElementById('view').textContent"))
        self.assertIn(f"value {picked['value']}", tab.js("document.getElementById('picked').textContent"))
        self.assertEqual(tab.js("document.getElementById('error').textContent"), "")
        tab.save(SHOTS, "package")

    def test_a_gateway_that_does_not_know_the_site_is_told_of_in_one_line(self):
        tab = self.open(f"package/example/?http://127.0.0.1:{self.closed.port}/#token={self.closed.token}")
        line = f"The gateway takes no requests from pages of {self.site}. Start it with --origin {self.site}."
        tab.until("told.some(t => t.type === 'slab-error')")
        self.assertEqual(tab.js("told[0].detail"), line)
        tab.until("document.querySelector('slab-view').shadowRoot.textContent.includes(arguments[0])", line)
        tab.save(SHOTS, "package-refused")

    def test_a_proxy_without_its_gateway_is_no_gateway(self):
        tab = self.open(f"package/example/?{self.serve('127.0.0.1', NoGateway)}/#token=abc")
        tab.until("told.some(t => t.type === 'slab-error')")
        self.assertTrue(tab.js("told[0].detail.startsWith('The gateway does not answer: ')"), tab.js("told[0].detail"))

    def test_the_component_of_react_shows_it(self):
        self.needs_react()
        bundle = ["esbuild", "app/app.tsx", "--bundle", "--format=esm", "--jsx=automatic", "--define:process.env.NODE_ENV='production'"]
        subprocess.run([*bundle, "--log-level=warning", "--outfile=app/app.js"], cwd=self.folder, check=True, env={**os.environ, "NODE_PATH": str(NODE)})
        tab = self.open(f"app/#http://127.0.0.1:{self.gateway.port}/%20{self.gateway.token}")
        self.final(tab, "o.azimuth === 200")
        tab.js("(document.querySelector('button').click(), true)")
        self.final(tab, "o.azimuth === 80")
        self.drag(tab, 50)
        self.final(tab, "o.azimuth !== 80")
        tab.until("document.getElementById('azimuth').textContent === document.querySelector('slab-view').state.azimuth")
        self.click(tab)
        tab.until("document.getElementById('value').textContent !== ''")
        tab.save(SHOTS, "package-react")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[5:]])
