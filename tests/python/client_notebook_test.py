"""docs/notebook.ipynb runs from top to bottom, and show() embeds a viewer that works. Exit status 77: skipped, since nbconvert is missing."""
from __future__ import annotations

import base64
import json
import os
import re
import subprocess
import sys
import time
import unittest
import unittest.mock
import urllib.error
import urllib.request

import numpy as np

from client_support import HEAVY, PROGRAMS, ROOT, START_SECONDS, InAFolder, WithAService, read_png

try:
    import ipykernel  # noqa: F401
    import jupyter_client
    import matplotlib  # noqa: F401
    import nbconvert  # noqa: F401
except ImportError as missing:
    print(f"skipped: {missing.name} is not installed (jupyter-nbconvert, python3-ipykernel, python3-matplotlib)")
    sys.exit(77)

import slabstream as ss  # noqa: E402


def when_ready(asked: urllib.request.Request, seconds: float = 60):
    """The answer of a gateway that may not have found its service yet."""
    limit = time.monotonic() + seconds
    while True:
        try:
            return urllib.request.urlopen(asked)
        except urllib.error.HTTPError as error:
            if error.code != 503 or time.monotonic() > limit:
                raise
            time.sleep(0.05)


class Notebook(InAFolder):
    def test_the_notebook_runs(self) -> None:
        environment = {name: value for name, value in os.environ.items() if not name.startswith("JUPYTER") and name != "MPLBACKEND"}
        environment |= {"PYTHONPATH": str(ROOT / "python"), "SLABSTREAM_PROGRAMS": str(PROGRAMS), "HOME": str(self.folder),
                        "IPYTHONDIR": str(self.folder)}
        done = subprocess.run(
            [sys.executable, "-m", "nbconvert", "--to", "notebook", "--execute", "--ExecutePreprocessor.timeout=600", "--output-dir", str(self.folder),
             "--output", "done.ipynb", str(ROOT / "docs" / "notebook.ipynb")],
            env=environment, capture_output=True, text=True, timeout=900,
        )
        self.assertEqual(done.returncode, 0, done.stderr[-4000:])
        cells = json.loads((self.folder / "done.ipynb").read_text())["cells"]
        kinds = [kind for cell in cells for output in cell.get("outputs", []) for kind in output.get("data", {})]
        self.assertGreaterEqual(kinds.count("image/png"), 3, "the picture and two plots")
        self.assertIn("text/html", kinds)  # the viewer
        source = json.loads((ROOT / "docs" / "notebook.ipynb").read_text())
        self.assertEqual([cell["outputs"] for cell in source["cells"] if cell["cell_type"] == "code" and cell["outputs"]], [], "without outputs")


class Interrupted(WithAService):
    def test_an_interrupted_kernel_cancels_its_frame_and_goes_on(self) -> None:
        manager, kernel = jupyter_client.manager.start_new_kernel(env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}, kernel_name="python3")
        self.addCleanup(manager.shutdown_kernel, now=True)
        self.addCleanup(kernel.stop_channels)

        def run(code: str) -> dict:
            return kernel.execute_interactive(code, timeout=START_SECONDS, stop_on_error=False, output_hook=lambda _: None)["content"]

        where = f"endpoint={self.running.endpoint!r}"
        self.assertEqual(run(f"import slabstream as ss\nservice = ss.connect({where})\nother = await ss.connect_async({where})")["status"], "ok")
        with ss.connect(endpoint=self.running.endpoint) as service:
            def until(busy: bool) -> ss.Status:
                limit = time.monotonic() + START_SECONDS
                while True:
                    status = service.status()
                    if bool(status.running + status.queued) == busy:
                        return status
                    self.assertLess(time.monotonic(), limit)

            for render in ("service.render", "await other.render"):
                with self.subTest(render=render):
                    done = until(busy=False).frames_done
                    kernel.execute(f"{render}('head', **{HEAVY})", stop_on_error=False)
                    until(busy=True)
                    manager.interrupt_kernel()
                    answer = kernel.get_shell_msg(timeout=START_SECONDS)["content"]
                    self.assertIn(answer.get("ename"), ("KeyboardInterrupt", "CancelledError"))
                    self.assertEqual(until(busy=False).frames_done, done, "given up, not finished")
                    self.assertEqual(run(f"assert ({render}('head', size=9)).size == (9, 9)")["status"], "ok")


class Shows(WithAService):
    def setUp(self) -> None:
        self.service = ss.connect(endpoint=self.running.endpoint)
        self.addCleanup(self.service.close)

    def test_the_viewer_serves_its_page_and_the_dataset(self) -> None:
        with unittest.mock.patch.dict(os.environ, {"JUPYTERHUB_SERVICE_PREFIX": ""}):
            viewer = self.service.show("head", width=500, height=300)
        bundle = viewer._repr_mimebundle_()
        self.assertRegex(bundle["text/html"], r'<iframe src="http://127.0.0.1:\d+/#token=[^"&]+&amp;dataset=head" style="width: 500px; height: 300px')
        origin, token = re.match(r"(http://[^/]+/)#token=([^&]+)", viewer.url).groups()
        with urllib.request.urlopen(origin) as page:
            self.assertIn("frame-ancestors 'self' http://localhost:*", page.headers["Content-Security-Policy"])
        picture = f"{origin}api/v1/render.png?token={token}&dataset=head&size=30"
        with urllib.request.urlopen(picture) as answer:
            np.testing.assert_array_equal(read_png(answer.read()), np.asarray(self.service.render("head", size=30)))
        self.assertEqual(self.service.show("head").url, viewer.url, "one gateway for a service")

    def test_where_the_browser_cannot_reach_it_there_is_a_picture(self) -> None:
        with unittest.mock.patch.dict(os.environ, {"JUPYTERHUB_SERVICE_PREFIX": "/user/a/"}):
            viewer = self.service.show("head", size=40, azimuth=30)
        self.assertIsNone(viewer.url)
        self.assertEqual(viewer._repr_mimebundle_()["image/png"], self.service.render("head", size=40, azimuth=30).png())
        with self.assertRaisesRegex(ss.InvalidArgument, "zoom"):
            self.service.show("head", zoom=0)

    def test_where_pages_cannot_be_framed_the_address_stands_below_a_picture(self) -> None:
        with unittest.mock.patch.dict(os.environ, {"VSCODE_PID": "7"}):
            viewer = self.service.show("head", size=40)
            framed = self.service.show("head", embed=True)
        html = viewer._repr_mimebundle_()["text/html"]
        png = re.search(r'<img alt="head" src="data:image/png;base64,([^"]+)">', html)[1]
        self.assertEqual(base64.b64decode(png), self.service.render("head", size=40).png())
        self.assertRegex(html, r'<a href="http://127.0.0.1:\d+/#token=[^"&]+&amp;dataset=head" target="_blank">Open the viewer of head</a>: http://127.0.0.1:\d+/<')
        self.assertNotIn("<iframe", html)
        self.assertIn("<iframe", framed._repr_mimebundle_()["text/html"])

    def test_a_proxy_leads_to_the_viewer(self) -> None:
        with unittest.mock.patch.dict(os.environ, {"JUPYTERHUB_SERVICE_PREFIX": "/user/a/"}):
            viewer = self.service.show("head", behind_proxy="https://hub.test/user/a/proxy/{port}/")
        port, token = re.match(r"https://hub\.test/user/a/proxy/(\d+)/#token=([^&]+)&dataset=head$", viewer.url).groups()
        self.assertIn('<iframe src="https://hub.test/user/a/proxy/', viewer._repr_mimebundle_()["text/html"])
        asked = urllib.request.Request(f"http://127.0.0.1:{port}/api/v1/datasets?token={token}", headers={"Host": "hub.test"})
        with when_ready(asked) as answer:
            self.assertEqual([each["name"] for each in json.load(answer)["datasets"]], ["head"])
            self.assertIn("https://hub.test", answer.headers["Content-Security-Policy"])
        with self.assertRaisesRegex(ss.InvalidArgument, "behind_proxy 'hub.test' is no address such as"):
            self.service.show("head", behind_proxy="hub.test")

    def test_arrays_are_shown_and_stay(self) -> None:
        viewer = ss.show(np.full((8, 9, 10), 3, np.uint8), service=self.service, embed=False)
        self.assertEqual(len(self.service.datasets()), 2)
        self.assertIn("image/png", viewer._repr_mimebundle_())
        del viewer
        self.assertEqual(len(self.service.datasets()), 1)


if __name__ == "__main__":
    unittest.main()
