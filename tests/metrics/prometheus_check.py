#!/usr/bin/env python3
"""Debian's Prometheus scrapes a running service with the configuration of deploy/monitoring, and promtool checks its files.

    prometheus_check.py FOLDER_OF_PROGRAMS
"""
import json
import re
import shutil
import socket
import subprocess
import sys
import urllib.parse
from pathlib import Path

from measured_service import TOKEN, MeasuredService, fetch, wait_until

MONITORING = Path(__file__).parents[2] / "deploy" / "monitoring"


def promtool(*arguments, text=None):
    """Fails if it complains, or has an opinion about metrics."""
    result = subprocess.run(["promtool", *map(str, arguments)], input=text, cwd=MONITORING, capture_output=True, text=True, check=False)
    if result.returncode or (text and (result.stdout or result.stderr)):
        raise AssertionError(f"promtool {' '.join(map(str, arguments))}: {result.stdout}{result.stderr}")
    print("promtool", *arguments, "finds nothing")


def configuration(service):
    """The example, with the ports of this service, and scraping once a second."""
    text = (MONITORING / "prometheus.yml").read_text()
    for example, address in zip(("127.0.0.1:9464", "127.0.0.1:9465", "127.0.0.1:9466", "127.0.0.1:8080"),
                                (service.coordinator, *service.workers, service.gateway)):
        assert text.count(f'"{example}"') == 1, example
        text = text.replace(f'"{example}"', f'"{address}"')
    # The second worker wants the token, too.
    text = text.replace(f', "{service.workers[1]}"]', f']\n  - job_name: slabstream-worker-with-token\n    static_configs:\n      - targets: ["{service.workers[1]}"]\n'
                        "    authorization:\n      credentials_file: gateway-token")
    text = re.sub(r"_interval: 15s", "_interval: 1s", text)
    shutil.copy(MONITORING / "alerts.yml", service.folder)
    (service.folder / "gateway-token").write_text(TOKEN)
    (service.folder / "prometheus.yml").write_text(text)


def check(service):
    for rule_check in (("check", "rules", "alerts.yml"), ("test", "rules", "alerts_test.yml"), ("check", "config", "--syntax-only", "prometheus.yml")):
        promtool(*rule_check)
    service.start_all()
    for number in range(4):
        picture = fetch(service.gateway, f"/api/v1/render.png?dataset=ball&size=32&azimuth={number}", headers={"Authorization": f"Bearer {TOKEN}"})
        assert picture[0] == 200, picture
    for address in (service.coordinator, *service.workers, service.gateway):
        promtool("check", "metrics", text=service.measure(address).text)

    configuration(service)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    with (service.folder / "prometheus.log").open("w") as log:
        prometheus = subprocess.Popen(["prometheus", "--config.file=prometheus.yml", "--storage.tsdb.path=prometheus-data", f"--web.listen-address={address}"],
                                      cwd=service.folder, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
    try:
        def ask(query):
            try:
                status, _, body = fetch(address, "/api/v1/query?" + urllib.parse.urlencode({"query": query}))
            except OSError:
                return None
            if status != 200:
                return None
            return {series["metric"].get("job", ""): float(series["value"][1]) for series in json.loads(body)["data"]["result"]}

        jobs = ("slabstream-coordinator", "slabstream-gateway", "slabstream-worker", "slabstream-worker-with-token")
        wait_until(lambda: ask("up") == dict.fromkeys(jobs, 1.0), "every target is up: " + (service.folder / "prometheus.log").read_text()[-500:])
        for query, expected in [
            ('slabstream_coordinator_frames_total{result="done"}', {"slabstream-coordinator": 4}),
            ("slabstream_coordinator_frame_seconds_count", {"slabstream-coordinator": 4}),
            ('slabstream_coordinator_workers{state="ready"}', {"slabstream-coordinator": 2}),
            ("slabstream_worker_registered", {"slabstream-worker": 1, "slabstream-worker-with-token": 1}),
            ("slabstream_gateway_frames_total", {"slabstream-gateway": 4}),
            ("slabstream_process_resident_memory_bytes < slabstream_process_memory_limit_bytes > bool 0",
             {"slabstream-coordinator": 1, "slabstream-worker": 1, "slabstream-worker-with-token": 1}),
        ]:
            wait_until(lambda q=query, e=expected: ask(q) == e, f"{query} is {ask(query)}")
        _, _, body = fetch(address, "/api/v1/rules")
        rules = json.loads(body)["data"]["groups"][0]["rules"]
        assert len(rules) == (MONITORING / "alerts.yml").read_text().count("- alert:") and all(rule["health"] != "err" for rule in rules), rules
        # Every query of the dashboard is one that Prometheus understands.
        dashboard = json.loads((MONITORING / "dashboard.json").read_text())
        queries = [target["expr"] for panel in dashboard["panels"] for target in panel["targets"]]
        for query in queries:
            assert ask(query.replace("$__rate_interval", "1m").replace("$coordinator", ".*")) is not None, query
        print(f"Prometheus scraped {len(jobs)} targets; {len(rules)} alerts and {len(queries)} queries of the dashboard are understood")
    finally:
        prometheus.terminate()
        prometheus.wait(timeout=60)


def main():
    service = MeasuredService(sys.argv[1])
    try:
        check(service)
    finally:
        service.close()


if __name__ == "__main__":
    main()
