"""A page without a browser: HTTP, a WebSocket (RFC 6455) and PNG with the standard library alone, for tests of the gateway."""
import base64
import copy
import hashlib
import hmac
import http.client
import json
import os
import socket
import ssl
import struct
import time
import zlib


def signed(secret, claims, header=None):
    """A JSON Web Token, as any program may make one that knows the gateway's token."""
    part = lambda data: base64.urlsafe_b64encode(data).rstrip(b"=")  # noqa: E731
    text = b".".join(part(json.dumps(each).encode()) for each in (header or {"alg": "HS256"}, claims))
    return (text + b"." + part(hmac.new(secret.encode(), text, hashlib.sha256).digest())).decode()


class Gateway:
    """Where one listens, from the line that it prints."""

    def __init__(self, url, context=None):
        origin, fragment = url.split("/#")
        self.token = dict(field.split("=", 1) for field in fragment.split("&"))["token"]
        self.scheme, self.authority = origin.split("://")
        host, port = self.authority.rsplit(":", 1)
        self.host, self.port = host.strip("[]"), int(port)
        self.context = context

    def holding(self, **claims):
        """The same for the holder of a token that expires, in an hour unless `exp` says when."""
        other = copy.copy(self)
        other.token = signed(self.token, {"exp": int(time.time()) + 3600, **claims})
        return other

    def connect(self, receive_bytes=0, source=None):
        """With `receive_bytes` the system keeps about so many for a reader that is slow. `source`: another address of this machine."""
        raw = socket.socket(socket.AF_INET)
        if source:
            raw.bind((source, 0))
        raw.settimeout(60)
        if receive_bytes:
            raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_bytes)
        raw.connect((self.host, self.port))
        return self.context.wrap_socket(raw, server_hostname=self.host) if self.context else raw

    def request(self, target, method="GET", body=None, token=True, headers=None):
        """Status, headers and body."""
        headers = dict(headers or {})
        if token:
            headers.setdefault("Authorization", "Bearer " + self.token)
        if self.context:
            connection = http.client.HTTPSConnection(self.host, self.port, timeout=120, context=self.context)
        else:
            connection = http.client.HTTPConnection(self.host, self.port, timeout=120)
        connection.request(method, target, body=body, headers=headers)
        response = connection.getresponse()
        data = response.read()
        connection.close()
        return response.status, response.headers, data

    def json(self, target, **more):
        status, _, body = self.request(target, **more)
        return status, json.loads(body)

    def raw(self, data):
        """The answer to any bytes, up to the end of the connection."""
        with self.connect() as connection:
            connection.sendall(data)
            answer = b""
            while chunk := connection.recv(65536):
                answer += chunk
            return answer


class Refused(Exception):
    pass


class Closed(Exception):
    def __init__(self, code, reason):
        super().__init__(f"{code} {reason}")
        self.code, self.reason = code, reason


class Page:
    """One WebSocket with one view."""

    def __init__(self, gateway, protocols=None, headers=None, target="/api/v1/view", receive_bytes=0):
        self.socket = gateway.connect(receive_bytes)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.buffer = b""
        self.seq = 0
        self.texts = []  # messages that came while others were waited for
        protocols = ["slabstream.view.v1", "slabstream.token." + gateway.token] if protocols is None else protocols
        fields = {"Host": gateway.authority, "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
                  "Sec-WebSocket-Key": base64.b64encode(os.urandom(16)).decode(), "Sec-WebSocket-Protocol": ", ".join(protocols)}
        fields.update(headers or {})
        self.socket.sendall((f"GET {target} HTTP/1.1\r\n" + "".join(f"{k}: {v}\r\n" for k, v in fields.items()) + "\r\n").encode())
        while b"\r\n\r\n" not in self.buffer:
            self._fill()
        head, self.buffer = self.buffer.split(b"\r\n\r\n", 1)
        self.head = head.decode()
        if " 101 " not in self.head.split("\r\n")[0]:
            self.socket.close()
            raise Refused(self.head.split("\r\n")[0])

    def _fill(self):
        chunk = self.socket.recv(1 << 20)
        if not chunk:
            raise Closed(1006, "the connection ended")
        self.buffer += chunk

    def _take(self, count):
        while len(self.buffer) < count:
            self._fill()
        taken, self.buffer = self.buffer[:count], self.buffer[count:]
        return taken

    def send_frame(self, opcode, payload):
        mask = os.urandom(4)
        size = len(payload)
        length = bytes([0x80 | size]) if size < 126 else b"\xfe" + struct.pack(">H", size) if size < 65536 else b"\xff" + struct.pack(">Q", size)
        repeated = (mask * (size // 4 + 1))[:size]
        masked = (int.from_bytes(payload, "big") ^ int.from_bytes(repeated, "big")).to_bytes(size, "big") if size else b""
        self.socket.sendall(bytes([0x80 | opcode]) + length + mask + masked)

    def send(self, message):
        self.send_frame(1, json.dumps(message).encode())

    def view(self, options, picture="render", **more):
        self.seq += 1
        self.send({"type": "view", "seq": self.seq, "picture": picture, "options": options, **more})
        return self.seq

    def ack(self, frame):
        self.send({"type": "ack", "frame": frame})

    def receive(self):
        """A text message as a dict, or a picture as (header, bytes)."""
        while True:
            first, second = self._take(2)
            size = second & 0x7F
            if size == 126:
                size = struct.unpack(">H", self._take(2))[0]
            elif size == 127:
                size = struct.unpack(">Q", self._take(8))[0]
            payload = self._take(size)
            opcode = first & 0x0F
            assert first & 0x80, "the gateway does not fragment"
            if opcode == 8:
                raise Closed(struct.unpack(">H", payload[:2])[0] if payload else 1005, payload[2:].decode())
            if opcode == 9:
                self.send_frame(10, payload)
            elif opcode == 1:
                return json.loads(payload)
            elif opcode == 2:
                n = struct.unpack("<I", payload[:4])[0]
                return json.loads(payload[4:4 + n]), payload[4 + n:]

    def text(self, kind, match=lambda message: True):
        """The next text message of this type."""
        while True:
            message = self.receive()
            if isinstance(message, tuple):
                self.ack(message[0]["frame"])
            elif message["type"] == kind and match(message):
                return message

    def picture(self):
        """The next picture, not acknowledged."""
        while True:
            message = self.receive()
            if isinstance(message, tuple):
                return message
            if message["type"] == "error":
                raise AssertionError(message)
            self.texts.append(message)

    def final(self, seq):
        """The lossless picture of this view, and how many pictures came on the way."""
        count = 0
        while True:
            header, data = self.picture()
            count += 1
            self.ack(header["frame"])
            if header["final"] and header["seq"] == seq:
                return header, data, count

    def close(self):
        self.socket.close()


def png_pixels(data):
    """Width, height and RGBA bytes of a PNG with 8 bits a channel."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed, width, height = 8, b"", 0, 0
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", body[:10])
            assert (depth, color) == (8, 6), (depth, color)
        elif kind == b"IDAT":
            packed += body
        at += 12 + size
    raw, row_bytes = zlib.decompress(packed), 4 * width
    above, rows = bytearray(row_bytes), []
    for y in range(height):
        begin = y * (row_bytes + 1)
        rule, row = raw[begin], bytearray(raw[begin + 1:begin + 1 + row_bytes])
        for i in range(row_bytes):
            left, up, corner = row[i - 4] if i >= 4 else 0, above[i], above[i - 4] if i >= 4 else 0
            if rule == 1:
                row[i] = (row[i] + left) & 255
            elif rule == 2:
                row[i] = (row[i] + up) & 255
            elif rule == 3:
                row[i] = (row[i] + (left + up) // 2) & 255
            elif rule == 4:
                p = left + up - corner
                distances = (abs(p - left), abs(p - up), abs(p - corner))
                row[i] = (row[i] + (left, up, corner)[distances.index(min(distances))]) & 255
        rows.append(bytes(row))
        above = row
    return width, height, b"".join(rows)


def whole(header, data, empty=b"\0\0\0\0"):
    """The pixels of a lossless picture with what lies outside its rectangle, of the colour `empty`."""
    width, height = header["size"]
    x, y, w, h = header["bounds"]
    rows = [empty * width] * height
    if w:
        got_w, got_h, pixels = png_pixels(data)
        assert (got_w, got_h) == (w, h)
        for row in range(h):
            rows[y + row] = empty * x + pixels[4 * w * row:4 * w * (row + 1)] + empty * (width - x - w)
    return width, height, b"".join(rows)
