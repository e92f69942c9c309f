#!/usr/bin/env python3
"""The gateway behind nginx, by the lines of docs/http.md.

    nginx_test.py FOLDER_OF_PROGRAMS NGINX [unittest arguments]
"""
import copy
import json
import os
import re
import socket
import ssl
import subprocess
import sys
import unittest
from pathlib import Path

from gateway_test import Programs, listening_port, wait_until
from page import Gateway, Page, Refused, png_pixels, whole

NGINX = sys.argv[2]
DOCUMENT = Path(__file__).resolve().parents[2] / "docs" / "http.md"
ORIGIN = "https://viewer.example.org"
TOKEN = "Jb8fXqkz3mYw0nT5sVQy1A"
CONFIGURATION = """
daemon off; user root; pid nginx.pid; error_log stderr;
events {}
http {
  access_log off; ssl_certificate cert.pem; ssl_certificate_key key.pem;
  client_body_temp_path t1; proxy_temp_path t2; fastcgi_temp_path t3; uwsgi_temp_path t4; scgi_temp_path t5;
  DOCUMENTED
}
"""


def block(first):
    """Lines of the document from the one that begins so, up to the next empty line."""
    return re.search(rf"^    {re.escape(first)}.*?(?=\n\n)", DOCUMENT.read_text(), re.MULTILINE | re.DOTALL)[0]


class NginxTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.programs = Programs()
        cls.addClassCleanup(cls.programs.close)
        folder = cls.programs.folder
        subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", "key.pem", "-out", "cert.pem", "-days", "2", "-subj",
                        "/CN=viewer.example.org", "-addext", "subjectAltName=IP:127.0.0.1"], cwd=folder, check=True, capture_output=True)
        cls.context = ssl.create_default_context(cafile=folder / "cert.pem")
        (folder / "token").write_text(TOKEN)
        (folder / "token").chmod(0o600)
        cls.programs.run("sphere", "--class", 1, "--size", 24, "--occupancy", 0.2, "-o", "a.nrrd")
        _, endpoint = cls.programs.up("--data", "a=a.nrrd")
        program, *arguments = block("slabstream-gateway --listen 127.0.0.1:8080 --token-file").replace(":8080", ":0").split()
        child = cls.programs.start(program, "--endpoint", endpoint, *arguments)
        address = child.stdout.readline().split()[1]
        assert address == ORIGIN + "/render/", address
        cls.gateway = Gateway(f"http://127.0.0.1:{listening_port(child.pid)}/#token={TOKEN}")
        wait_until(lambda: cls.gateway.request("/readyz")[0] == 200, "ready")

    def proxy(self, takes_path_away):
        """The gateway as clients of nginx reach it. Nginx is given its socket, as if another one of its kind had listened before."""
        listener = socket.create_server(("127.0.0.1", 0))
        port = listener.getsockname()[1]
        lines = block("map $http_upgrade").replace("listen 443 ssl", f"listen 127.0.0.1:{port} ssl")
        upstream = "proxy_pass http://127.0.0.1:8080"
        self.assertEqual(lines.count(upstream), 1)
        lines = lines.replace(upstream, f"proxy_pass http://127.0.0.1:{self.gateway.port}{'/' if takes_path_away else ''}")
        (self.programs.folder / "nginx.conf").write_text(CONFIGURATION.replace("DOCUMENTED", lines))
        environment = {**os.environ, "NGINX": f"{listener.fileno()};"}
        child = self.programs.start(NGINX, "-p", self.programs.folder, "-c", "nginx.conf", "-e", "stderr", env=environment, pass_fds=[listener.fileno()])
        listener.close()
        self.addCleanup(self.programs.end, child)
        seen = copy.copy(self.gateway)
        seen.port, seen.authority, seen.context = port, "viewer.example.org", self.context
        return seen

    def test_pages_pictures_and_files_pass(self):
        fields = "?dataset=a&size=64&azimuth=40"
        expected = self.gateway.request(f"/api/v1/render.png{fields}")[2]
        for takes_path_away in (False, True):
            seen = self.proxy(takes_path_away)
            self.assertEqual(seen.request("/render", token=False)[0], 301, "the page's addresses are relative")
            status, headers, page = seen.request("/render/", token=False)
            self.assertEqual((status, headers["Content-Type"].split(";")[0]), (200, "text/html"))
            for asset in re.findall(r'(?:src|href)="([^"]+)"', page.decode()):
                self.assertEqual(seen.request(f"/render/{asset}", token=False)[0], 200, asset)
            self.assertTrue(seen.request(f"/render/api/v1/render.png{fields}")[2] == expected)
            # The largest part of a file.
            size = 1 << 20
            begun = seen.json(f"/render/api/v1/upload?file=b.nrrd&bytes={2 * size}", method="POST", body=b"")[1]["upload"]
            part = seen.json(f"/render/api/v1/upload?upload={begun}&begin=0", method="POST", body=bytes(size))
            self.assertEqual(part, (200, {"received": size}))
            seen.request(f"/render/api/v1/upload?upload={begun}&drop=true", method="POST", body=b"")

    def test_the_websocket_passes(self):
        options = {"dataset": "a", "size": 64, "azimuth": 40}
        status, _, picture = self.gateway.request("/api/v1/render.png", method="POST", body=json.dumps(options))
        self.assertEqual(status, 200)
        for takes_path_away in (False, True):
            seen = self.proxy(takes_path_away)
            page = Page(seen, target="/render/api/v1/view", headers={"Origin": ORIGIN})
            self.addCleanup(page.close)
            self.assertEqual(page.receive()["type"], "hello")
            header, data, _ = page.final(page.view(options))
            self.assertTrue(whole(header, data) == png_pixels(picture))
            with self.assertRaisesRegex(Refused, "403"):
                Page(seen, target="/render/api/v1/view", headers={"Origin": "https://example.org"})


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
