#!/usr/bin/env python3
"""Traces as an OpenTelemetry collector gets them from the command line and from the gateway: the real programs, against a server of Python.

    traces_test.py FOLDER_OF_PROGRAMS [unittest arguments]
"""
import collections
import json
import os
import signal
import socket
import sys
import unittest
import urllib.parse

from collector import Collector, SilentCollector, check_tree, nobody, spans_in
from measured_service import TOKEN, MeasuredService, fetch, wait_until

PROGRAMS = sys.argv[1] if len(sys.argv) > 1 else None
TRACE, SPAN = "4bf92f3577b34da6a3ce929d0e0e4736", "00f067aa0ba902b7"
HEADER = f"00-{TRACE}-{SPAN}-01"


class WithPrograms(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.service = MeasuredService(PROGRAMS)
        cls.addClassCleanup(cls.service.close)
        for name in [name for name in cls.service.environment if name.startswith("OTEL_") or name == "TRACEPARENT"]:
            del cls.service.environment[name]

    def collector(self, kind=Collector, **answer):
        collector = kind(**answer)
        self.addCleanup(collector.close)
        return collector


class CommandLineTest(WithPrograms):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.service.run("slabstream", "sphere", "--class", 2, "--size", 32, "-o", "ball.nrrd").check_returncode()

    def render(self, url, *arguments, command="render", output="x.png", environment=None):
        (self.service.folder / output).unlink(missing_ok=True)
        before = dict(self.service.environment)
        self.service.environment.update(environment or {})
        try:
            return self.service.run("slabstream", command, "ball.nrrd", "--local=2", "--size", 32, "-o", output, "--otlp", url, *arguments)
        finally:
            self.service.environment = before

    def test_a_picture_is_a_trace(self):
        collector = self.collector()
        result = self.render(collector.url, "--groups", 2)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        path, headers, body = collector.request()
        self.assertEqual((path, headers["Content-Type"]), ("/v1/traces", "application/json"))
        spans, source = spans_in(body)
        self.assertEqual(source["service.name"], "slabstream")
        self.assertIn(source["service.version"], self.service.run("slabstream", "--version").stdout)
        self.assertRegex(source["service.instance.id"], r"^[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}$")
        self.assertEqual(source["process.executable.name"], "slabstream")
        root = check_tree(spans)
        self.assertEqual((root.name, root.kind, root.attributes["slabstream.source"]), ("slabstream render", 1, "ball.nrrd"))
        names = collections.Counter(span.name for span in spans)
        self.assertEqual((names["frame"], names["worker"]), (1, 2))
        for stage in ("fetch", "render", "combine", "resolve"):
            self.assertGreaterEqual(names[stage], 1, names)
        (frame,) = (span for span in spans if span.name == "frame")
        self.assertEqual((frame.parent, frame.kind), (root.id, 3))
        self.assertEqual((frame.attributes["slabstream.output"], frame.attributes["slabstream.workers"]), ("x.png", 2))
        self.assertGreater(frame.attributes["slabstream.voxel_bytes"], 0)
        # On one host no clock differs: no stage is as long as the frame by being moved or cut off.
        renders = [span for span in spans if span.name == "render"]
        self.assertTrue(all(0 < span.end - span.begin < frame.end - frame.begin for span in renders), renders)
        self.assertEqual({span.attributes["slabstream.worker"] for span in renders}, {span.attributes["slabstream.worker"] for span in spans if span.name == "worker"})

    def test_the_same_spans_stand_in_the_file_of_trace(self):
        collector = self.collector()
        self.assertEqual(self.render(collector.url, "--trace", "t.json").returncode, 0)
        events = json.loads((self.service.folder / "t.json").read_text())["traceEvents"]
        stages = sorted((event["name"], event["pid"], round(event["dur"] * 1000)) for event in events if event["ph"] == "X" and event["pid"] != 0)
        spans = [span for span in collector.spans() if "slabstream.box" in span.attributes]
        self.assertEqual(sorted((span.name, span.attributes["slabstream.worker"], span.end - span.begin) for span in spans), stages)

    def test_frames_of_a_turntable_are_one_trace_in_several_requests(self):
        collector = self.collector()
        result = self.render(collector.url + "/elsewhere", "--frames", 60, command="turntable", output="f%02d.png")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        spans = []
        while not any(span.name == "slabstream turntable" for span in spans):
            path, _, body = collector.request()
            self.assertEqual(path, "/elsewhere")
            spans += spans_in(body)[0]
        self.assertTrue(collector.requests.empty())
        check_tree(spans)
        self.assertEqual([span.attributes["slabstream.output"] for span in spans if span.name == "frame"], [f"f{i:02d}.png" for i in range(60)])

    def test_a_script_hands_its_span_over(self):
        collector = self.collector()
        self.assertEqual(self.render(collector.url, environment={"TRACEPARENT": HEADER}).returncode, 0)
        root = check_tree(collector.spans(), SPAN)
        self.assertEqual((root.name, root.trace), ("slabstream render", TRACE))
        self.assertEqual(self.render(collector.url, environment={"TRACEPARENT": HEADER[:-1] + "0"}).returncode, 0)  # which nobody records
        self.assertEqual(self.render(collector.url, environment={"TRACEPARENT": "nonsense"}).returncode, 0)
        self.assertNotEqual(check_tree(collector.spans()).trace, TRACE)
        self.assertTrue(collector.requests.empty())

    def test_a_picture_needs_no_collector(self):
        gone, refusing, busy = nobody(), self.collector(status=400, body=b'{"code":3,\n"message":"bad"}'), self.collector(status=503, body=b"")
        silent = self.collector(SilentCollector)
        partial = self.collector(body=b'{"partialSuccess":{"rejectedSpans":"2","errorMessage":"too old"}}')
        for url, why in [
            (gone, rf"{gone[7:]}: Connection refused"),
            (refusing.url, rf'{refusing.url}/v1/traces answers 400: {{"code":3,\?"message":"bad"}}'),
            (busy.url, rf"{busy.url}/v1/traces answers 503"),
            (partial.url, rf"{partial.url}/v1/traces rejects 2 spans: too old"),
            (silent.url, rf"{silent.url[7:]} has not answered within 5\.0 s"),
            ("http://no-such-host.invalid:4318", r"no-such-host\.invalid:4318: .+"),
        ]:
            result = self.render(url)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertRegex(result.stderr, rf"^slabstream: warning: --otlp: {why}\n$")
            self.assertTrue((self.service.folder / "x.png").read_bytes().startswith(b"\x89PNG"))

    def test_wrong_addresses_are_refused_before_work_begins(self):
        for url, why in [
            ("https://127.0.0.1:4318", "--otlp 'https://127.0.0.1:4318' asks for TLS, which is not spoken here: it takes http://HOST:PORT"),
            ("127.0.0.1:4318", "--otlp '127.0.0.1:4318' is not an address such as http://127.0.0.1:4318"),
            ("http://127.0.0.1:port", "--otlp 'http://127.0.0.1:port' is not an address such as http://127.0.0.1:4318"),
            ("", "--otlp '' is not an address"),
        ]:
            for command, more in (("render", ()), ("turntable", ("--frames", 2))):
                result = self.render(url, *more, command=command, output="x.png" if command == "render" else "f%d.png")
                self.assertEqual(result.returncode, 2)
                self.assertIn(why, result.stderr)
                self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
                self.assertFalse((self.service.folder / "x.png").exists())
            result = self.service.run("slabstream-gateway", "--endpoint", "ipc:///nowhere", "--otlp", url)
            self.assertEqual(result.returncode, 2)
            self.assertIn(why, result.stderr)


class GatewayTest(WithPrograms):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.service.start_all()

    def gateway(self, url, environment=None):
        before = dict(self.service.environment)
        self.service.environment.update(environment or {})
        try:
            child = self.service.start_gateway(*([] if url is None else ["--otlp", url]))
        finally:
            self.service.environment = before
        self.addCleanup(self.end, child)
        wait_until(lambda: fetch(self.service.gateway, "/readyz")[0] == 200, "the gateway")
        return child

    def end(self, child):
        child.send_signal(signal.SIGTERM)
        self.assertEqual(child.wait(timeout=120), 0)

    def get(self, path, headers=None, **fields):
        headers = {"Authorization": f"Bearer {TOKEN}", **(headers or {})}
        return fetch(self.service.gateway, f"/api/v1/{path}?" + urllib.parse.urlencode({"dataset": "ball", **fields}), headers=headers)

    def traces(self, result):
        return self.service.measure(self.service.gateway)("gateway_traces_total", result=result)

    def test_a_request_stands_in_the_trace_of_its_caller(self):
        collector = self.collector()
        self.gateway(collector.url)
        status, _, picture = self.get("render.png", {"traceparent": HEADER}, size=48, token=TOKEN)
        self.assertEqual((status, picture[:4]), (200, b"\x89PNG"))
        path, headers, body = collector.request()
        self.assertEqual((path, headers["Content-Type"]), ("/v1/traces", "application/json"))
        self.assertNotIn(TOKEN.encode(), body)
        spans, source = spans_in(body)
        self.assertEqual((source["service.name"], source["process.executable.name"]), ("slabstream", "slabstream-gateway"))
        root = check_tree(spans, SPAN)
        self.assertEqual((root.name, root.kind, root.trace, root.error), ("GET /api/v1/render.png", 2, TRACE, False))
        self.assertEqual(root.attributes, {"http.request.method": "GET", "http.route": "/api/v1/render.png", "url.path": "/api/v1/render.png",
                                           "url.scheme": "http", "http.response.status_code": 200})
        names = collections.Counter(span.name for span in spans)
        self.assertEqual((names["frame"], names["worker"], names["encode-file"]), (1, 2, 1))
        self.assertGreaterEqual(names["render"], 2)
        (frame,) = (span for span in spans if span.name == "frame")
        self.assertEqual((frame.parent, frame.kind, frame.attributes["slabstream.dataset"]), (root.id, 3, "ball"))
        renders = [span for span in spans if span.name == "render"]
        self.assertTrue(all(0 < span.end - span.begin < frame.end - frame.begin for span in renders), renders)
        wait_until(lambda: self.traces("sent") == 1, "it is counted")
        self.assertEqual(self.traces("dropped"), 0)

    def test_every_picture_and_question_has_a_trace_and_nothing_else_has(self):
        collector = self.collector()
        self.gateway(collector.url)
        self.assertEqual(self.get("render.png", {"traceparent": HEADER[:-1] + "0"}, size=16)[0], 200)  # nobody records it
        self.assertEqual(self.get("datasets")[0], 200)
        self.assertEqual(fetch(self.service.gateway, "/")[0], 200)
        self.assertEqual(fetch(self.service.gateway, "/api/v1/render.png?dataset=ball")[0], 401)
        for path, fields, status, names in [
            ("slice.png", {"plane": "zyx", "size": 16}, 200, {"frame": 3, "encode-file": 1}),
            ("histogram", {}, 200, {}),
            ("value", {"at": "1,2,3"}, 200, {}),
            ("render.png", {"size": "x"}, 400, {}),
            ("render.png", {"dataset": "nothing"}, 404, {"frame": 1}),
        ]:
            self.assertEqual(self.get(path, **fields)[0], status)
            spans = collector.spans()
            root = check_tree(spans)
            self.assertEqual((root.name, root.attributes["http.response.status_code"], root.error), (f"GET /api/v1/{path}", status, False))
            found = collections.Counter(span.name for span in spans)
            self.assertEqual({name: found[name] for name in ("frame", "encode-file") if found[name]}, names)
            failed = [span for span in spans if span.error]
            self.assertEqual([(span.name, span.attributes["error.type"]) for span in failed], [("frame", "not found")] if status == 404 else [])
        self.assertTrue(collector.requests.empty())

    def test_a_request_whose_caller_has_gone_says_so(self):
        collector = self.collector()
        self.gateway(collector.url)
        for worker in self.service.worker_processes:
            worker.send_signal(signal.SIGSTOP)  # so that the picture is not ready before
        try:
            host, port = self.service.gateway.split(":")
            with socket.create_connection((host, int(port)), timeout=120) as connection:
                connection.sendall(f"GET /api/v1/render.png?dataset=ball HTTP/1.1\r\nHost: {host}\r\nAuthorization: Bearer {TOKEN}\r\n\r\n".encode())
                wait_until(lambda: self.service.measure(self.service.coordinator)("coordinator_running_frames") == 1, "it runs")
            (root,) = collector.spans()
            self.assertEqual((root.name, root.error, root.message), ("GET /api/v1/render.png", True, "whoever asked has gone"))
        finally:
            for worker in self.service.worker_processes:
                worker.send_signal(signal.SIGCONT)

    def test_a_variable_of_the_standard_names_the_collector(self):
        collector = self.collector()
        self.gateway(None, {"OTEL_EXPORTER_OTLP_ENDPOINT": collector.url + "/base"})
        self.assertEqual(self.get("render.png", size=16)[0], 200)
        self.assertEqual(collector.request()[0], "/base/v1/traces")
        self.service.environment["OTEL_EXPORTER_OTLP_ENDPOINT"] = "https://127.0.0.1:4318"
        try:
            result = self.service.run("slabstream-gateway", "--endpoint", self.service.endpoint)
        finally:
            del self.service.environment["OTEL_EXPORTER_OTLP_ENDPOINT"]
        self.assertEqual(result.returncode, 2)
        self.assertRegex(result.stderr, r"^slabstream-gateway: \$OTEL_EXPORTER_OTLP_ENDPOINT 'https://127\.0\.0\.1:4318' asks for TLS[^\n]*\n$")

    def test_pictures_come_whatever_becomes_of_their_traces(self):
        for url, why in [
            (nobody(), "Connection refused"),
            (self.collector(status=400).url, "answers 400"),
            (self.collector(status=503).url, "answers 503"),
            (self.collector(SilentCollector).url, "has not answered within 5.0 s"),
        ]:
            child = self.gateway(url)
            for _ in range(3):
                self.assertEqual(self.get("render.png", size=16)[0], 200)
            wait_until(lambda: self.traces("dropped") >= 1, f"{why}: dropped")
            self.assertEqual(self.traces("sent"), 0)
            self.assertIsNone(child.poll())
            log = max(self.service.folder.glob("slabstream-gateway-*.log"), key=os.path.getmtime).read_text().splitlines()
            dropped = [line for line in log if "traces are dropped" in line]
            self.assertEqual(len(dropped), 1, log)
            self.assertIn(why, dropped[0])


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
