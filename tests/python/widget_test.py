"""The notebook's widget, without a browser: what a page would send goes to it over a comm, and comes back from a real gateway. Exit status 77:
skipped, since anywidget or websockets is missing."""
from __future__ import annotations

import base64
import json
import os
import pathlib
import queue
import signal
import socket
import struct
import sys
import textwrap
import threading
import time
import unittest
import unittest.mock

import numpy as np

from client_support import ROOT, WithAService, read_png, volume_arrays

try:
    import IPython.core.interactiveshell
    import anywidget  # noqa: F401
    import comm
    import comm.base_comm
    import traitlets
    import websockets.sync.client  # noqa: F401
except ImportError as missing:
    print(f"skipped: {missing.name} is not installed (pip install anywidget websockets)")
    sys.exit(77)

import slabstream as ss  # noqa: E402
from slabstream import gateway, relay  # noqa: E402
from slabstream import widget as widget_module  # noqa: E402

SECONDS = 60  # far above what anything needs


class Page(comm.base_comm.BaseComm):
    """The page's end of a widget's comm."""

    def publish_msg(self, msg_type, data=None, metadata=None, buffers=None, **keys):
        if not hasattr(self, "heard"):
            self.heard, self.updates = queue.Queue(), queue.Queue()
        if (data or {}).get("method") == "custom":
            self.heard.put((data["content"], [bytes(each) for each in buffers or ()]))
        elif (data or {}).get("method") == "update":
            self.updates.put(data["state"])

    def say(self, message: dict, *buffers: bytes) -> None:
        self.handle_msg({"content": {"data": {"method": "custom", "content": message}}, "buffers": list(buffers)})

    def write(self, **traits) -> None:
        self.handle_msg({"content": {"data": {"method": "update", "state": traits, "buffer_paths": []}}, "buffers": []})

    def hear(self, wanted) -> tuple[dict, list[bytes]]:
        """The next message of which `wanted` is true; others are passed over."""
        limit = time.monotonic() + SECONDS
        while True:
            message, buffers = self.heard.get(timeout=max(limit - time.monotonic(), 0.01))
            if wanted(message):
                return message, buffers

    def ask(self, number: int, path: str, method: str = "GET", *body: bytes) -> tuple[dict, bytes]:
        """Again while the gateway does not hear its service."""
        limit = time.monotonic() + SECONDS
        while True:
            self.say({"ask": number, "method": method, "path": path}, *body)
            message, (found,) = self.hear(lambda message: message.get("answer") == number)
            if message["status"] != 503 or time.monotonic() > limit:
                return message, found

    def stream(self, number: int) -> None:
        """As a page does, it opens it again if it was closed."""
        message: dict = {}
        while "opened" not in message:
            self.say({"open": number})
            message, _ = self.hear(lambda message: number in (message.get("opened"), message.get("closed")))

    def view(self, number: int, seq: int, **options) -> None:
        self.say({"send": number, "text": json.dumps({"type": "view", "seq": seq, "picture": "render", "timeline": False, "options": options})})

    def frame(self, number: int) -> tuple[dict, bytes]:
        """The next picture of a stream, which is acknowledged: its header, and the encoded rectangle."""
        _, (content,) = self.hear(lambda message: message.get("heard") == number and "text" not in message)
        size, = struct.unpack_from("<I", content)
        header = json.loads(content[4 : 4 + size])
        self.say({"send": number, "text": json.dumps({"type": "ack", "frame": header["frame"]})})
        return header, content[4 + size :]

    def final(self, number: int, seq: int) -> tuple[dict, bytes]:
        while True:
            header, picture = self.frame(number)
            if header["seq"] == seq and header["final"]:
                return header, picture


class Widgets(WithAService):
    def setUp(self) -> None:
        for patch in (unittest.mock.patch.object(comm, "create_comm", Page),
                      unittest.mock.patch.object(gateway.Gateway, "asset", lambda self, name: f"// {name}")):
            patch.start()
            self.addCleanup(patch.stop)
        self.service = ss.connect(endpoint=self.running.endpoint)
        self.addCleanup(self.service.close)

    def widget(self, **options) -> tuple[ss.Widget, Page]:
        widget = self.service.view("head", **options)
        self.addCleanup(widget.close)
        return widget, widget.comm

    def test_requests_are_answered(self) -> None:
        _, page = self.widget()
        message, found = page.ask(7, "datasets")
        self.assertEqual((message["status"], message["type"]), (200, "application/json"), found)
        self.assertEqual([each["name"] for each in json.loads(found)["datasets"]], ["head"])
        message, found = page.ask(2**53 - 1, "render.png", "POST", json.dumps({"dataset": "head", "size": 30, "azimuth": 30}).encode())
        np.testing.assert_array_equal(read_png(found), np.asarray(self.service.render("head", size=30, azimuth=30)))
        message, found = page.ask(8, "render.png?dataset=head&zoom=0")
        self.assertEqual(message["status"], 400)
        self.assertIn("zoom", json.loads(found)["error"])

    def test_a_hundred_views_come_to_the_last_one(self) -> None:
        _, page = self.widget()
        page.stream(5)
        message, _ = page.hear(lambda message: message.get("heard") == 5)
        self.assertEqual(json.loads(message["text"])["type"], "hello")
        for seq in range(1, 101):
            page.view(5, seq, dataset="head", size="40x40", azimuth=seq, background="#102030")
        header, picture = page.final(5, 100)
        x, y, width, height = header["bounds"]
        wanted = np.asarray(self.service.render("head", size=40, azimuth=100, background="#102030"))
        np.testing.assert_array_equal(read_png(picture), wanted[y : y + height, x : x + width])
        page.say({"close": 5})
        message, _ = page.hear(lambda message: "closed" in message)
        self.assertEqual(message, {"closed": 5, "reason": ""})

    def test_streams_of_two_tabs_are_apart(self) -> None:
        _, page = self.widget()
        page.stream(11)
        page.stream(12)
        page.view(11, 1, dataset="head", size="40x40", azimuth=10)
        one, _ = page.final(11, 1)
        page.view(12, 1, dataset="head", size="40x40", azimuth=200)
        two, _ = page.final(12, 1)
        self.assertNotEqual(one["geometry"]["forward"], two["geometry"]["forward"])

    def test_a_page_that_says_nothing_has_gone(self) -> None:
        _, page = self.widget()
        with unittest.mock.patch.object(relay, "_SILENT_SECONDS", 2.5):
            page.stream(1)
            page.stream(2)
            names = iter(range(10))
            while next(names) < 9:  # one is named as often as the other one hears something
                page.say({"alive": [2]})
                message, _ = page.hear(lambda message: message.get("heard") == 1 or "closed" in message)
                if "closed" in message:
                    break
            self.assertEqual(message, {"closed": 1, "reason": "the page has gone"})
            for _ in range(4):
                page.say({"alive": [2]})
                message, _ = page.hear(lambda message: 2 in (message.get("heard"), message.get("closed")))
                self.assertNotIn("closed", message)
        page.say({"close": 2})
        page.hear(lambda message: message == {"closed": 2, "reason": ""})

    def test_no_more_streams_are_opened_than_a_widget_may_have(self) -> None:
        _, page = self.widget()
        with unittest.mock.patch.object(relay, "_MOST_STREAMS", 2):
            page.stream(1)
            page.stream(2)
            page.say({"open": 2})  # it is open
            page.say({"open": 3})
            message, _ = page.hear(lambda message: message.get("closed") in (2, 3))
            self.assertEqual(message, {"closed": 3, "reason": "2 streams of this widget are open, no more are taken"})
            page.say({"close": 1})
            page.hear(lambda message: message == {"closed": 1, "reason": ""})
            page.stream(3)
            page.view(3, 1, dataset="head", size="40x40")
            page.final(3, 1)

    def test_a_gateway_that_was_killed_is_started_again(self) -> None:
        widget, page = self.widget()
        before = widget._address
        page.stream(1)
        for each in gateway._gateways.values():
            if each.url == before:
                shell = each.program._shell.pid
                os.kill(int(pathlib.Path(f"/proc/{shell}/task/{shell}/children").read_text().split()[0]), signal.SIGKILL)
        page.hear(lambda message: message.get("closed") == 1)
        page.stream(2)
        page.view(2, 1, dataset="head", size="40x40")
        page.final(2, 1)
        self.assertNotEqual(widget._address, before)
        self.assertEqual(page.ask(3, "datasets")[0]["status"], 200)

    def test_state_goes_both_ways(self) -> None:
        widget, page = self.widget(azimuth=30, transfer="viridis")
        self.assertEqual(widget._state, {"dataset": "head", "azimuth": "30", "transfer": "viridis"})
        self.assertEqual(widget.camera, ss.Camera(azimuth=30))
        seen = []
        widget.observe(lambda change: seen.append(change["new"]), "camera")
        page.write(_state={**widget._state, "azimuth": "47.5", "elevation": "-3", "look-at": "1,2,3"})
        self.assertEqual(seen, [ss.Camera(azimuth=47.5, elevation=-3, look_at=(1, 2, 3))])
        widget.camera = {"zoom": 2}
        self.assertEqual(page.updates.get(timeout=SECONDS)["_state"],
                         {"dataset": "head", "azimuth": "47.5", "elevation": "-3", "look-at": "1,2,3", "zoom": "2", "transfer": "viridis"})
        widget.transfer = ss.TransferFunction([(0, (0, 0, 0)), (200, (1, 0.5, 0))], [(20, 0), (200, 1)])
        widget.scalar_range = 10, 180
        widget.channels = None
        state = widget.state
        self.assertEqual((state["function"], state["scalar-range"], "transfer" in state), ("python|0,0,0,0;200,1,0.5,0|20,0;200,1", "10:180", False))
        self.assertEqual(widget.transfer.opacities, [(20.0, 0.0), (200.0, 1.0)])
        wanted = self.service.render("head", size=50, azimuth=47.5, elevation=-3, look_at=(1, 2, 3), zoom=2, background="#0d1014", scalar_range=(10, 180),
                                     transfer=widget.transfer)
        np.testing.assert_array_equal(np.asarray(widget.picture(size=50)), np.asarray(wanted))
        for name, value, says in (("camera", {"zoom": 0}, "zoom 0 is out of range"), ("camera", {"azimut": 0}, "camera has the field 'azimut'"),
                                  ("scalar_range", (3, 3), "scalar_range"), ("channels", {"a": 3}, "channels"), ("state", {"azimuth": "x"}, "state has no camera")):
            with self.assertRaisesRegex(ss.InvalidArgument, says):
                setattr(widget, name, value)
        self.assertEqual(widget.state, state)

    def test_what_the_page_says_does_not_come_back(self) -> None:
        widget, page = self.widget()
        other, others_page = self.widget()
        traitlets.link((widget, "camera"), (other, "camera"))
        for number in range(20):
            page.write(_state={"dataset": "head", "azimuth": f"{number}.10", "elevation": "5e0"})  # not as Python writes it
            self.assertEqual(other.camera, ss.Camera(azimuth=number + 0.1, elevation=5))
            others_page.write(_state={"dataset": "head", "azimuth": f"{number}.1", "elevation": "5"})
        self.assertTrue(page.updates.empty())
        self.assertEqual(others_page.updates.qsize(), 20)

    def test_events_reach_python(self) -> None:
        widget, page = self.widget()
        picked, failed = [], []
        widget.on_pick(picked.append)
        widget.on_error(failed.append)
        wanted = self.service.pick("head", 20, 20, size=40)
        _, found = page.ask(1, "pick?dataset=head&x=20&y=20&size=40")
        page.say({"picked": json.loads(found)})
        page.say({"picked": {"hit": False}})
        page.say({"picked": {"hit": True, "depth": 9, "at": [1, 2, 3], "inside": False, "voxel": None, "value": None, "shape": "vessel", "shape_number": 2,
                             "shape_value": 0.5}})
        page.say({"error": "no such thing"})
        outside = ss.Sample(at=(1, 2, 3), index=None, value=None, depth=9, shape="vessel", shape_number=2, shape_value=0.5)
        self.assertEqual(picked, [wanted, None, outside])
        self.assertEqual(failed, ["no such thing"])

    def test_a_saved_notebook_has_a_picture(self) -> None:
        widget, _ = self.widget(azimuth=30, size=40)
        data, _ = widget._repr_mimebundle_()
        self.assertEqual(widget._css, "")
        self.assertIn("application/vnd.jupyter.widget-view+json", data)
        wanted = self.service.render("head", size=40, azimuth=30, fit=True, background="#0d1014")
        np.testing.assert_array_equal(read_png(base64.b64decode(data["image/png"])), np.asarray(wanted))
        widget.camera = {"azimuth": 90}
        data, _ = widget._repr_mimebundle_()
        np.testing.assert_array_equal(read_png(base64.b64decode(data["image/png"])), np.asarray(widget.picture()))

    def test_close_ends_its_streams_and_lets_go_of_the_volume(self) -> None:
        widget = ss.view(np.full((8, 9, 10), 3, np.uint8), service=self.service)
        page = widget.comm
        page.stream(1)
        self.assertEqual(len(self.service.datasets()), 2)
        widget.close()
        for thread in threading.enumerate():
            if thread.name.startswith("slabstream stream"):
                thread.join(SECONDS)
                self.assertFalse(thread.is_alive())
        self.assertEqual(len(self.service.datasets()), 1)

    def test_a_cell_that_runs_again_lets_go_of_its_volumes(self) -> None:
        shell = IPython.core.interactiveshell.InteractiveShell()
        shell.get_parent = lambda: {"metadata": {"cellId": running}}  # as a kernel's
        shell.events.register("pre_run_cell", widget_module._close_gone)
        shell.user_ns["view"] = lambda: ss.view(np.full((8, 9, 10), 3, np.uint8), service=self.service)
        with unittest.mock.patch.object(widget_module, "get_ipython", lambda: shell):
            for running, code, datasets in (("a", "two = view(), view()", 3), ("b", "other = view()", 4), ("a", "two = view(), view()", 4), (None, "3", 4),
                                            ("a", "3", 2), ("d", "other.comm._closed = True", 2), ("c", "last = view()", 2), ("c", "last.close()", 1)):
                shell.run_cell(code, cell_id=running).raise_error()
                self.assertEqual(len(self.service.datasets()), datasets, (running, code))

    def test_the_tutorial_runs(self) -> None:
        text = (ROOT / "docs" / "python.md").read_text()
        section = text[text.index("## In a notebook") : text.index("## Pictures")]
        code = textwrap.dedent(section[section.index("    import traitlets") : section.index("\n`camera`")])
        names = {"ss": ss, "array": volume_arrays()[0], "spacing": (2, 1.5, 1.25)}
        self.addCleanup(ss.shutdown)
        exec(compile(code, "python.md", "exec"), names)
        self.assertEqual(names["second"].camera, ss.Camera(azimuth=90, zoom=2))
        self.assertGreater(np.asarray(names["image"])[..., :3].max(), 50)

    def test_what_is_no_message_is_ignored(self) -> None:
        _, page = self.widget()
        for message in ({}, {"send": 9, "text": ""}, {"close": 9}, {"cancel": 9}, {"alive": [9]}, {"other": 1}):
            page.say(message)
        self.assertEqual(page.ask(1, "datasets")[0]["status"], 200)


class SilentGateway:
    """Takes connections and answers none."""

    token = "token"

    def __init__(self) -> None:
        self.listener = socket.create_server(("127.0.0.1", 0), backlog=512)
        self.listener.settimeout(SECONDS)
        self.host, self.port = self.listener.getsockname()

    def accept(self) -> socket.socket:
        connection, _ = self.listener.accept()
        connection.settimeout(SECONDS)
        return connection


class Asks(unittest.TestCase):
    def setUp(self) -> None:
        self.gateway, self.said, self.started = SilentGateway(), queue.Queue(), threading.Event()
        self.addCleanup(self.gateway.listener.close)
        self.relay = relay.Relay(self.find, lambda message, _: self.said.put(message), lambda: None)

    def find(self, gone: object) -> SilentGateway:
        self.started.wait(SECONDS)
        return self.gateway

    def threads(self) -> list:
        return [each for each in threading.enumerate() if each.name == "slabstream ask"]

    def ask(self, number: int) -> None:
        self.relay.hear({"ask": number, "path": "datasets"}, [])

    def test_a_cancelled_request_ends_its_connection(self) -> None:
        self.started.set()
        for number in range(5):
            self.ask(number)
            with self.gateway.accept() as connection:
                self.assertIn(b"GET /api/v1/datasets ", connection.recv(65536))
                self.relay.hear({"cancel": number}, [])
                self.assertEqual(connection.recv(65536), b"")
        self.assertTrue(self.said.empty())

    def test_cancelled_requests_count_until_they_have_ended(self) -> None:
        for number in range(200):
            self.ask(number)
            self.relay.hear({"cancel": number}, [])
        self.assertEqual(len(self.threads()), relay._MOST_ASKS)
        self.assertEqual({self.said.get_nowait()["status"] for _ in range(200 - relay._MOST_ASKS)}, {429})
        self.started.set()
        for _ in range(relay._MOST_ASKS):
            with self.gateway.accept() as connection:
                self.assertEqual(connection.recv(65536), b"")  # nobody asks for anything
        for thread in self.threads():
            thread.join(SECONDS)
        self.assertEqual((self.threads(), self.said.qsize()), ([], 0))

    def test_the_same_number_is_one_request(self) -> None:
        self.ask(1)
        self.ask(1)
        self.assertEqual(len(self.threads()), 1)
        self.relay.close()
        self.started.set()
        with self.gateway.accept() as connection:
            self.assertEqual(connection.recv(65536), b"")


if __name__ == "__main__":
    unittest.main()
