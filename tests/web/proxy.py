"""A proxy before a gateway: it adds a delay each way, counts connections, and can answer requests itself."""
import http.client
import json
import queue
import socket
import threading
import time
import urllib.parse


class Proxy:
    """Listens at 127.0.0.1:port. `answers` maps paths to functions of (fields, body) that return JSON, a text that is a web page, or the status of an error. With
    a `prefix` the gateway lies below that path, which the proxy takes away; `strays` are requests that lie elsewhere."""

    def __init__(self, host, port, delay=0.0, answers=None, prefix=""):
        self.upstream, self.delay, self.answers, self.prefix = (host, port), delay, answers or {}, prefix
        self.strays = []
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.open, self.relayed, self.frozen = set(), set(), set()
        self.lock = threading.Lock()
        self.ended = False
        threading.Thread(target=self._accept, daemon=True).start()

    def cut(self):
        """Ends all connections, as a network does that fails."""
        with self.lock:
            connections, self.open = self.open, set()
        for connection in connections:
            try:
                connection.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass

    def freeze(self):
        """The open WebSockets carry nothing any more, and nobody is told, as when a network forgets them. New ones work."""
        with self.lock:
            self.frozen |= self.relayed

    def close(self):
        self.ended = True
        self.listener.close()
        self.cut()

    def _accept(self):
        while not self.ended:
            try:
                connection, _ = self.listener.accept()
            except OSError:
                return
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            with self.lock:
                self.open.add(connection)
            threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, connection):
        try:
            head = b""
            while b"\r\n\r\n" not in head:
                chunk = connection.recv(65536)
                if not chunk:
                    return
                head += chunk
            head, rest = head.split(b"\r\n\r\n", 1)
            lines = head.decode("latin-1").split("\r\n")
            method, target, _ = lines[0].split(" ")
            fields = {name.lower(): value.strip() for name, value in (line.split(":", 1) for line in lines[1:])}
            if not target.startswith(self.prefix + "/"):
                self.strays.append(target)
                return connection.sendall(b"HTTP/1.1 404 .\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")
            target = target[len(self.prefix):]
            head = b" ".join([method.encode(), target.encode("latin-1"), head.split(b" ", 2)[2]])
            if fields.get("upgrade", "").lower() == "websocket":
                self._relay(connection, head + b"\r\n\r\n" + rest)
            else:
                self._answer(connection, method, target, fields, rest)
        except OSError:
            pass
        finally:
            with self.lock:
                self.open.discard(connection)
            connection.close()

    def _answer(self, connection, method, target, fields, body):
        while len(body) < int(fields.get("content-length", 0)):
            body += connection.recv(65536)
        time.sleep(2 * self.delay)  # what this class is for: a slow network
        parts = urllib.parse.urlsplit(target)
        own = self.answers.get(parts.path)
        answer = own(dict(urllib.parse.parse_qsl(parts.query)), json.loads(body) if body else None) if own else None
        if isinstance(answer, str):
            status, kind, data, more = 200, "text/html; charset=utf-8", answer.encode(), []
        elif answer is not None:
            status, answer = (answer, {"error": "as the test wants it"}) if isinstance(answer, int) else (200, answer)
            kind, data, more = "application/json", json.dumps(answer).encode(), []
        else:
            upstream = http.client.HTTPConnection(*self.upstream, timeout=60)
            kept = {name: value for name, value in fields.items() if name not in ("connection", "content-length", "accept-encoding")}
            upstream.request(method, target, body=body or None, headers=kept)
            response = upstream.getresponse()
            status, kind, data = response.status, response.headers.get("Content-Type", ""), response.read()
            more = [(n, v) for n, v in response.headers.items() if n.lower() not in ("content-type", "content-length", "connection", "transfer-encoding")]
            upstream.close()
        lines = [f"HTTP/1.1 {status} .", f"Content-Type: {kind}", f"Content-Length: {len(data)}", "Connection: close", *(f"{n}: {v}" for n, v in more)]
        connection.sendall("\r\n".join(lines).encode("latin-1") + b"\r\n\r\n" + data)

    def _relay(self, connection, first):
        upstream = socket.create_connection(self.upstream)
        upstream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        with self.lock:
            self.open.add(upstream)
            self.relayed |= {connection, upstream}
        upstream.sendall(first)
        back = threading.Thread(target=self._carry, args=(upstream, connection), daemon=True)
        back.start()
        self._carry(connection, upstream)
        back.join()
        with self.lock:
            self.open.discard(upstream)
        upstream.close()

    # Every byte arrives `delay` seconds after it was sent; the rate stays.
    def _carry(self, source, sink):
        under_way = queue.Queue()

        def deliver():
            while True:
                due, chunk = under_way.get()
                time.sleep(max(0.0, due - time.monotonic()))
                try:
                    if chunk:
                        sink.sendall(chunk)
                        continue
                    sink.shutdown(socket.SHUT_WR)
                except OSError:
                    pass
                return

        deliverer = threading.Thread(target=deliver, daemon=True)
        deliverer.start()
        while True:
            try:
                chunk = source.recv(65536)
            except OSError:
                chunk = b""
            if chunk and source in self.frozen:
                continue
            under_way.put((time.monotonic() + self.delay, chunk))
            if not chunk:
                break
        deliverer.join()
