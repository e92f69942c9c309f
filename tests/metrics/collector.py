"""An OpenTelemetry collector with the standard library alone: keeps what it is sent, and answers as it is told."""
import http.server
import json
import queue
import socket
import threading

TIMEOUT = 120  # far above what anything needs


class Span:
    """A span of the JSON encoding, checked for its form."""

    def __init__(self, fields):
        self.trace, self.id, self.parent = fields["traceId"], fields["spanId"], fields.get("parentSpanId")
        for text, digits in ((self.trace, 32), (self.id, 16), (self.parent, 16)):
            assert text is None or (len(text) == digits and set(text) <= set("0123456789abcdef") and set(text) != {"0"}), fields
        self.name, self.kind = fields["name"], fields["kind"]
        assert isinstance(fields["startTimeUnixNano"], str) and isinstance(fields["endTimeUnixNano"], str), fields
        self.begin, self.end = int(fields["startTimeUnixNano"]), int(fields["endTimeUnixNano"])
        assert self.begin <= self.end, fields
        self.attributes = attributes(fields["attributes"])
        self.error = fields.get("status", {}).get("code") == 2
        self.message = fields.get("status", {}).get("message", "")

    def __repr__(self):
        return f"{self.name} {self.attributes}"


def attributes(entries):
    values = {}
    for entry in entries:
        ((kind, value),) = entry["value"].items()
        assert entry["key"] not in values, entry
        values[entry["key"]] = {"stringValue": str, "intValue": int, "boolValue": bool}[kind](value)
    return values


def spans_in(body):
    """The spans of a request, and what it says of who made them."""
    (resource_spans,) = json.loads(body)["resourceSpans"]
    (scope_spans,) = resource_spans["scopeSpans"]
    return [Span(fields) for fields in scope_spans["spans"]], attributes(resource_spans["resource"]["attributes"])


def check_tree(spans, outer=None):
    """The only span whose parent is not among them, or is `outer`. The others lie within their parents, and all belong to one trace."""
    by_id = {span.id: span for span in spans}
    assert len(by_id) == len(spans), spans
    (root,) = (span for span in spans if span.parent == outer)
    for span in spans:
        assert span.trace == root.trace, span
        if span is not root:
            parent = by_id[span.parent]
            assert parent.begin <= span.begin and span.end <= parent.end, (span, parent)
    return root


class Collector:
    def __init__(self, status=200, body=b"{}"):
        self.requests = queue.Queue()  # path, headers, body
        collector = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_POST(self):
                received = self.rfile.read(int(self.headers["Content-Length"]))
                collector.requests.put((self.path, self.headers, received))  # before the answer, after which the next one may come
                self.send_response(status)
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_port}"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def request(self):
        """The next one: path, headers, body."""
        return self.requests.get(timeout=TIMEOUT)

    def spans(self):
        """Those of the next request."""
        return spans_in(self.request()[2])[0]

    def close(self):
        self.server.shutdown()
        self.server.server_close()


class SilentCollector:
    """Takes connections and never answers."""

    def __init__(self):
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self.socket.getsockname()[1]}"

    def close(self):
        self.socket.close()


def nobody():
    """An address at which nobody listens."""
    collector = SilentCollector()
    collector.close()
    return collector.url
