#!/usr/bin/env python3
"""What coordinators, workers and gateways tell Prometheus of a service that renders, and what strangers get from them.

    metrics_test.py FOLDER_OF_PROGRAMS [unittest arguments]
"""
import json
import re
import signal
import socket
import sys
import unittest
from pathlib import Path

from measured_service import TOKEN, MeasuredService, fetch, wait_until

PROGRAMS = Path(sys.argv[1]) if len(sys.argv) > 1 else None
MONITORING = Path(__file__).parents[2] / "deploy" / "monitoring"


class WithService(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.service = MeasuredService(PROGRAMS)
        cls.addClassCleanup(cls.service.close)
        cls.service.start_all()

    def render(self, number=1, **more):
        target = "/api/v1/render.png?" + "&".join(f"{name}={value}" for name, value in {"dataset": "ball", "size": 48, "azimuth": number, **more}.items())
        return fetch(self.service.gateway, target, headers={"Authorization": f"Bearer {TOKEN}"})


class NumbersTest(WithService):
    def test_numbers_are_those_of_what_was_rendered(self):
        frames = 5
        for number in range(frames):
            self.assertEqual(self.render(number)[0], 200)
        self.assertEqual(self.render(dataset="none")[0], 404)
        # Metrics may be those of 50 ms ago, before the frames.
        def measured():
            values = self.service.measure(self.service.coordinator)
            return values("coordinator_running_frames") == 0 and values("coordinator_refused_total", reason="unknown dataset") == 1

        wait_until(measured, "rest")

        coordinator = self.service.measure(self.service.coordinator)
        self.assertEqual(coordinator("coordinator_frames_total", result="done"), frames)
        self.assertEqual(coordinator("coordinator_frames_total", result="failed"), 0)
        self.assertEqual(coordinator("coordinator_frames_total", result="cancelled"), 0)
        self.assertEqual(coordinator("coordinator_refused_total", reason="unknown dataset"), 1)
        self.assertEqual(coordinator("coordinator_frame_seconds_count"), frames)
        self.assertEqual(coordinator("coordinator_queue_seconds_count"), frames)
        self.assertGreater(coordinator("coordinator_frame_seconds_sum"), coordinator("coordinator_queue_seconds_sum"))
        self.assertEqual(coordinator("coordinator_queued_frames"), 0)
        self.assertEqual(coordinator("coordinator_workers", state="ready"), 2)
        self.assertEqual(coordinator("coordinator_workers", state="leaving"), 0)
        self.assertEqual(coordinator("coordinator_datasets", state="ready"), 1)
        self.assertGreaterEqual(coordinator("coordinator_voxel_bytes"), 32**3)
        self.assertEqual(coordinator("process_memory_limit_bytes"), 1 << 30)

        workers = [self.service.measure(address) for address in self.service.workers]
        total = lambda name, **labels: sum(worker(name, **labels) for worker in workers)
        self.assertEqual(total("worker_registered"), 2)
        self.assertEqual(total("worker_leaving"), 0)
        self.assertGreaterEqual(total("worker_boxes_total", result="done"), frames)
        self.assertEqual(total("worker_boxes_total", result="failed"), 0)
        self.assertEqual(total("worker_render_seconds_count"), total("worker_boxes_total", result="done"))
        self.assertAlmostEqual(total("worker_render_seconds_sum"), total("worker_stage_seconds_total", stage="render"), 6)
        self.assertAlmostEqual(total("worker_render_seconds_sum"), coordinator("coordinator_stage_seconds_total", stage="render"), 6)
        self.assertEqual(total("worker_queued_boxes"), 0)
        self.assertGreaterEqual(total("worker_cached_bytes"), 32**3 / 2)
        self.assertEqual(total("worker_fetched_bytes_total"), coordinator("coordinator_bytes_total", plane="voxels"))
        self.assertGreater(total("worker_sent_bytes_total", plane="pictures"), 0)
        self.assertEqual(total("worker_unsent_total"), 0)

        gateway = self.service.measure(self.service.gateway)
        self.assertEqual(gateway("gateway_frames_total"), frames)
        self.assertEqual(gateway("gateway_stage_seconds_count", stage="latency"), frames)
        self.assertEqual(gateway("gateway_bytes_total", plane="voxels"), coordinator("coordinator_bytes_total", plane="voxels"))
        self.assertEqual(gateway("service_up"), 1)
        for process in (coordinator, *workers):
            self.assertLess(process("process_resident_memory_bytes"), process("process_memory_limit_bytes"))
        for process in (coordinator, *workers, gateway):
            self.assertGreater(process("process_cpu_seconds_total"), 0)
            self.assertGreater(process("process_open_fds"), 3)


class FilesTest(WithService):
    def test_dashboard_and_alerts_ask_for_metrics_that_there_are(self):
        self.assertEqual(self.render()[0], 200)
        there = set()
        for address in (self.service.coordinator, *self.service.workers, self.service.gateway):
            there |= self.service.measure(address).names()
        dashboard = json.loads((MONITORING / "dashboard.json").read_text())
        queries = [target["expr"] for panel in dashboard["panels"] for target in panel["targets"]]
        queries += [variable["query"]["query"] for variable in dashboard["templating"]["list"] if variable["type"] == "query"]
        queries.append((MONITORING / "alerts.yml").read_text())
        queries.append((MONITORING / "alerts_test.yml").read_text())
        asked = {name for query in queries for name in re.findall(r"\bslabstream_[a-z_]+", query)}
        self.assertGreater(len(asked), 20)
        self.assertEqual(asked - there, set())
        for panel in dashboard["panels"]:
            self.assertTrue(panel["targets"] and all("slabstream_" in target["expr"] for target in panel["targets"]), panel["title"])

    def test_documents_name_every_metric(self):
        self.assertEqual(self.render()[0], 200)
        table = (MONITORING.parents[1] / "docs" / "on-servers.md").read_text()
        for address in (self.service.coordinator, *self.service.workers):
            for name in self.service.measure(address).types:
                self.assertIn(f"`{name}`", table)


class StrangersTest(WithService):
    def test_a_worker_with_a_token_wants_it(self):
        address = self.service.workers[1]
        for authorization in (None, "", "Bearer", "Bearer ", "Bearer " + TOKEN[:-1], "Bearer " + TOKEN + "x", "Bearer x" + TOKEN[1:], "bearer " + TOKEN, "Basic " + TOKEN, TOKEN):
            status, headers, body = fetch(address, headers={} if authorization is None else {"Authorization": authorization})
            self.assertEqual((status, headers["WWW-Authenticate"]), (401, "Bearer"), authorization)
            self.assertNotIn(b"slabstream_", body)
        self.assertEqual(fetch(address, "/", headers={"Authorization": "Bearer wrong"})[0], 401)
        self.assertEqual(fetch(address, headers={"Authorization": f"Bearer {TOKEN}"})[0], 200)
        # Whoever has the token may call the host as it likes.
        self.assertEqual(fetch(address, headers={"Authorization": f"Bearer {TOKEN}", "Host": "node7.example:9464"})[0], 200)

    def test_there_is_nothing_but_metrics(self):
        address = self.service.coordinator
        self.assertEqual(fetch(address)[0], 200)
        self.assertEqual(fetch(address, "/metrics?a=b")[0], 200)
        status, headers, body = fetch(address, method="HEAD")
        self.assertEqual((status, body), (200, b""))
        self.assertGreater(int(headers["Content-Length"]), 1000)
        for target in ("/", "/metrics/", "/metricsx", "/../metrics", "//metrics", "/etc/passwd", "/%2e%2e/metrics", "*", "x" * 4000):
            self.assertEqual(fetch(address, target)[0], 404, target)
        for method in ("POST", "PUT", "DELETE", "OPTIONS", "TRACE", "BREW"):
            self.assertEqual(fetch(address, method=method, body="x")[0], 405, method)
        self.assertEqual(fetch(address, headers={"Host": "evil.example"})[0], 403)
        self.assertEqual(fetch(address, headers={"Origin": "https://evil.example"})[0], 403)
        upgrade = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13", "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}
        self.assertEqual(fetch(address, headers=upgrade)[0], 404)

    def raw(self, address, data):
        host, port = address.split(":")
        with socket.create_connection((host, int(port)), timeout=60) as connection:
            answer = b""
            try:
                connection.sendall(data)
                connection.shutdown(socket.SHUT_WR)
                while chunk := connection.recv(65536):
                    answer += chunk
            except OSError:  # it was cut off
                pass
            return answer

    def test_hostile_requests_do_no_harm(self):
        for address in (self.service.coordinator, self.service.workers[0]):
            host = f"Host: {address}\r\n".encode()
            request = b"GET /metrics HTTP/1.1\r\n" + host
            for data, status in [
                (b"\x00" * 1000, 400), (bytes(range(256)) * 40, 400), (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc", 400), (b"GET\r\n\r\n", 400),
                (b"GET /metrics HTTP/9.9\r\n\r\n", 400), (request + b"X: " + b"a" * 100000 + b"\r\n\r\n", 431),
                (request + b"A: b\r\n" * 20000 + b"\r\n", 431), (request + b"Content-Length: 99999999999\r\n\r\n", 413),
                (request + b"Transfer-Encoding: chunked\r\n\r\nffffffff\r\n" + b"a" * 5000, 413), (request + b"Content-Length: -1\r\n\r\n", 400),
                (request, None), (b"", None), (request[:9], None),
            ]:
                answer = self.raw(address, data)
                if status is not None and answer:  # what it has not read may cut the connection off before the answer is read
                    self.assertRegex(answer[:60], rb"^HTTP/1\.1 4\d\d ", data[:60])
            # More connections than it serves, that say nothing or read nothing: the next one is still answered.
            idle, port = [], int(address.split(":")[1])
            for number in range(60):
                connection = socket.create_connection(("127.0.0.1", port), timeout=60)
                connection.setblocking(False)
                try:
                    connection.send(b"" if number % 3 == 0 else request if number % 3 == 1 else (request + b"\r\n") * 400)
                except OSError:
                    pass
                idle.append(connection)
            self.service.measure(address)
            for connection in idle:
                connection.close()
            self.service.measure(address)
        self.assertEqual(self.render()[0], 200)
        self.assertTrue(all(child.poll() is None for child in self.service.children))
        for address in (self.service.coordinator, self.service.workers[0]):
            wait_until(lambda at=address: self.service.measure(at)("process_open_fds") < 200, "connections are closed")

    def test_many_questions_in_a_row_are_answered(self):
        texts = [self.service.measure(self.service.coordinator) for _ in range(50)]
        self.assertEqual({text("coordinator_workers", state="ready") for text in texts}, {2.0})

    def test_wrong_options_are_refused(self):
        listen = ("--listen", "tcp://127.0.0.1:*")
        short = self.service.folder / "short"
        short.write_text("short\n")
        short.chmod(0o600)
        for arguments, why in [
            (("--metrics", "0.0.0.0:0"), "--metrics 0.0.0.0 is not loopback: it needs --metrics-token-file"),
            (("--metrics", "x"), "--metrics 'x' is not a port"),
            (("--metrics", "70000"), "--metrics '70000' is not a port"),
            (("--metrics-token-file", self.service.token_file), "--metrics-token-file needs --metrics"),
            (("--metrics", "0", "--metrics-token-file", short), "the token has 5 characters"),
            (("--metrics", "0", "--metrics-token-file", self.service.folder / "none"), "--metrics-token-file"),
            (("--metrics", self.service.coordinator), "cannot listen"),
        ]:
            for program, more in (("slabstream-coordinator", listen), ("slabstream-worker", ("--coordinator", self.service.worker_endpoint))):
                result = self.service.run(program, *more, *arguments)
                self.assertIn(result.returncode, (1, 2), arguments)
                self.assertIn(why, result.stderr)
        result = self.service.run("slabstream", "up", "--metrics", 65535, "--workers", 1)
        self.assertEqual(result.returncode, 2)
        self.assertIn("need the ports after it", result.stderr)


class LossTest(WithService):
    def test_workers_that_leave_or_are_lost_are_counted(self):
        state = lambda: self.service.measure(self.service.coordinator)
        leaving, _ = self.service.start_worker()
        lost, _ = self.service.start_worker()
        wait_until(lambda: state()("coordinator_workers", state="ready") == 4, "four workers")
        leaving.terminate()
        lost.kill()
        wait_until(lambda: state()("coordinator_workers", state="ready") == 2, "two workers")
        wait_until(lambda: state()("coordinator_workers_lost_total") == 1, "a lost one")
        self.assertEqual(state()("coordinator_workers", state="leaving"), 0)

    def test_a_cancelled_frame_is_no_failure(self):
        state = lambda: self.service.measure(self.service.coordinator)
        done = state()("coordinator_frames_total", result="done")
        for worker in self.service.worker_processes:
            worker.send_signal(signal.SIGSTOP)  # so that the frame is not done before it is cancelled
        try:
            client, log = self.service.start("slabstream", "render", "ball", "--endpoint", self.service.endpoint, "-o", "never.png")
            wait_until(lambda: (now := state())("coordinator_running_frames") + now("coordinator_queued_frames") == 1, "it runs")
            client.send_signal(signal.SIGINT)
            self.assertEqual(client.wait(timeout=60), 130, log.read_text())
            wait_until(lambda: state()("coordinator_frames_total", result="cancelled") == 1, "it is cancelled")
        finally:
            for worker in self.service.worker_processes:
                worker.send_signal(signal.SIGCONT)
        now = state()
        self.assertEqual(now("coordinator_frames_total", result="failed"), 0)
        self.assertEqual(now("coordinator_frames_total", result="done"), done)
        self.assertEqual(now("coordinator_running_frames") + now("coordinator_queued_frames"), 0)

    def test_up_serves_the_metrics_of_all_its_processes(self):
        def free_ports(count):
            sockets = [socket.socket() for _ in range(count)]
            first = 20000 + (sockets[0].fileno() * 997 + id(sockets)) % 9000
            try:
                for number, each in enumerate(sockets):
                    each.bind(("127.0.0.1", first + number))
            except OSError:
                return None
            finally:
                for each in sockets:
                    each.close()
            return first

        first = wait_until(lambda: free_ports(3), "free ports")
        child, log = self.service.start("slabstream", "up", "--listen", f"ipc://{self.service.folder}/up", "--workers", 2, "--threads", 1, "--metrics", first)
        self.assertIn("is up", child.stdout.readline(), log.read_text())
        self.assertEqual(self.service.measure(f"127.0.0.1:{first}")("coordinator_workers", state="ready"), 2)
        for number in (1, 2):
            self.assertEqual(self.service.measure(f"127.0.0.1:{first + number}")("worker_registered"), 1)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
