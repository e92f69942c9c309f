"""docs/notebook.ipynb runs from top to bottom, and view() shows a picture where it has no widget. Exit status 77: skipped, since nbconvert is missing."""
from __future__ import annotations

import base64
import functools
import http.server
import json
import os
import re
import subprocess
import sys
import threading
import time
import unittest
import unittest.mock
import urllib.error
import urllib.request

import numpy as np

from client_support import HEAVY, PROGRAMS, ROOT, START_SECONDS, InAFolder, WithAService, read_png, write_cells

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

        for patch in (unittest.mock.patch.dict(sys.modules, {"slabstream.widget": None}), unittest.mock.patch.dict(os.environ, {"JUPYTERHUB_SERVICE_PREFIX": ""})):
            patch.start()  # without anywidget; widget_test.py is with it
            self.addCleanup(patch.stop)

    def test_without_anywidget_there_is_a_picture_and_the_viewers_address(self) -> None:
        viewer = self.service.view("head", size=40, azimuth=30, transfer="viridis")
        bundle = viewer._repr_mimebundle_()
        png = re.search(r'<img alt="head" src="data:image/png;base64,([^"]+)">', bundle["text/html"])[1]
        self.assertEqual(base64.b64decode(png), bundle["image/png"])
        self.assertEqual(bundle["image/png"], self.service.render("head", size=40, azimuth=30, transfer="viridis", fit=True, background="#0d1014").png())
        self.assertRegex(bundle["text/html"], r'<a href="http://127.0.0.1:\d+/#token=[^"&]+&amp;dataset=head&amp;azimuth=30&amp;transfer=viridis" target="_blank">'
                                              r"Open the viewer of head</a>: http://127.0.0.1:\d+/. pip install .slabstream\[widget\]. makes a viewer")
        origin, token = re.match(r"(http://[^/]+/)#token=([^&]+)", viewer.url).groups()
        picture = f"{origin}api/v1/render.png?token={token}&dataset=head&size=30"
        with when_ready(urllib.request.Request(picture)) as answer:
            np.testing.assert_array_equal(read_png(answer.read()), np.asarray(self.service.render("head", size=30)))
        self.assertEqual(self.service.view("head").url.partition("&")[0], viewer.url.partition("&")[0], "one gateway for a service")

        with self.assertRaisesRegex(ImportError, r"slabstream.Widget needs slabstream.widget: pip install 'slabstream\[widget\]'"):
            ss.Widget

    def test_where_the_browser_cannot_reach_it_there_is_no_address(self) -> None:
        with unittest.mock.patch.dict(os.environ, {"JUPYTERHUB_SERVICE_PREFIX": "/user/a/"}):
            viewer = self.service.view("head", size=40)
            self.assertIsNone(viewer.url)
            self.assertNotIn("href", viewer._repr_mimebundle_()["text/html"])

    def test_options_that_the_viewer_lacks_are_refused(self) -> None:
        for options, says in (({"zoom": 0}, "zoom 0 is out of range"), ({"eye": (1, 2, 3)}, r"the viewer has no eye; picture\(eye=...\) takes it"),
                              ({"clip_box": ":,:,:50%"}, "clip_box is in voxels or percent"), ({"height": 0}, "height 0 is neither")):
            with self.assertRaisesRegex(ss.InvalidArgument, says):
                self.service.view("head", **options)

    def test_states_are_the_options_of_pictures(self) -> None:
        """Options become a state, and the state the same picture."""
        function = ss.TransferFunction([(0, (0, 0, 0)), (200, (1, 0.5, 0))], [(20, 0), (150, 0.4, 0.3, 0.2), (200, 1)], {"ambient": 0.5})
        regions = ss.TransferFunction(regions=[ss.Region.box((60, 200), (0, 90), (0.8, 0.1, 0.1), 0.5)])
        for options in (
            {"view": "left", "zoom": 1.3, "roll": 12, "projection": "perspective", "renderer": "raycast", "sampling_rate": 3},
            {"transfer": function, "scalar_range": (10, 180), "opacity_distance": 2, "gradient_opacity": [(0, 0.1), (20, 1)], "renderer": "raycast"},
            {"transfer": regions, "renderer": "raycast"}, {"transfer": "plasma"}, {"isovalue": [(60, "teal", 0.4), (150, "#ffcc99")], "renderer": "raycast"},
            {"isovalue": (150, "#ffcc99"), "transfer": "viridis", "renderer": "raycast", "light": [(1, -1, 1), (-1, -1, 0)], "background": "navy"},
            {"clip_plane": [(1, 0, 0, 5), (0, 1, 0, -9)], "clip_box": ((None, 20), (None, None), (25, None)), "clip_mode": "cut-away"},
            {"labels": True}, {"label_mode": "surface", "labels_shown": [1, 3], "label_opacity": {1: 0.4}, "renderer": "raycast"},
            {"overlay": True, "overlay_range": (0.1, 0.9), "overlay_transfer": "viridis", "overlay_weight": 0.7, "renderer": "raycast"},
        ):
            with self.subTest(options):
                viewer = self.service.view("head", size=40, **options)
                whole = {"background": "#0d1014", "fit": True} | options
                np.testing.assert_array_equal(np.asarray(viewer.picture()), np.asarray(self.service.render("head", size=40, **whole)))

    def test_a_proxy_leads_to_the_viewer(self) -> None:
        with unittest.mock.patch.dict(os.environ, {"JUPYTERHUB_SERVICE_PREFIX": "/user/a/"}):
            viewer = self.service.view("head", behind_proxy="https://hub.test/user/a/proxy/{port}/")
            port, token = re.match(r"https://hub\.test/user/a/proxy/(\d+)/#token=([^&]+)&dataset=head$", viewer.url).groups()
        asked = urllib.request.Request(f"http://127.0.0.1:{port}/api/v1/datasets?token={token}", headers={"Host": "hub.test"})
        with when_ready(asked) as answer:
            self.assertEqual([each["name"] for each in json.load(answer)["datasets"]], ["head"])
        with self.assertRaisesRegex(ss.InvalidArgument, "behind_proxy 'hub.test' is no address such as"):
            self.service.view("head", behind_proxy="hub.test")

    def test_arrays_are_viewed_and_stay(self) -> None:
        viewer = ss.view(np.full((8, 9, 10), 3, np.uint8), service=self.service)
        self.assertEqual(len(self.service.datasets()), 2)
        self.assertIn("image/png", viewer._repr_mimebundle_())
        viewer.close()
        self.assertEqual(len(self.service.datasets()), 1)


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_) -> None:
        pass


class Channels(InAFolder):
    def test_addresses_are_viewed(self) -> None:
        path = write_cells(self.folder)
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(self.folder)))
        self.addCleanup(server.server_close)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        self.addCleanup(server.shutdown)
        with unittest.mock.patch.dict(sys.modules, {"slabstream.widget": None}):
            shown = dict(size=40, time=1, channels={"DAPI": {"color": "white"}})
            viewer = ss.view(f"http://127.0.0.1:{server.server_port}/{path.name}", **shown)  # it is not loaded yet
            self.addCleanup(viewer.close)
            np.testing.assert_array_equal(np.asarray(viewer.picture()), np.asarray(ss.render(path, background="#0d1014", fit=True, **shown)))

    def test_states_of_channels_are_the_options_of_pictures(self) -> None:
        with unittest.mock.patch.dict(sys.modules, {"slabstream.widget": None}), ss.load(write_cells(self.folder)) as cells:
            for options in ({}, {"time": 2}, {"time": "2.5s", "channels": ["Actin"]}, {"channels": ["DAPI"], "transfer": "viridis"},
                            {"channels": {"Actin": {"color": "lime", "range": (100, 900), "gamma": 0.7, "opacity": 0.5}, "DAPI": {"shown": False}}},
                            {"channels": {"0": {"transfer": "plasma"}, "1": None}, "blend": "over"}):
                with self.subTest(options):
                    wanted = cells.render(size=40, background="#0d1014", fit=True, **options)
                    np.testing.assert_array_equal(np.asarray(cells.view(size=40, **options).picture()), np.asarray(wanted))


if __name__ == "__main__":
    unittest.main()
