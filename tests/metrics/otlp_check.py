#!/usr/bin/env python3
"""OpenTelemetry's own schema reads what the programs send: each request is an ExportTraceServiceRequest without an unknown field.

    otlp_check.py FOLDER_OF_PROGRAMS      # by a Python with tests/metrics/requirements.txt
"""
import sys
import urllib.parse

from collector import Collector, spans_in
from google.protobuf import json_format
from measured_service import TOKEN, MeasuredService, fetch
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest
from opentelemetry.proto.trace.v1.trace_pb2 import Span, Status


def parse(body):
    """The spans as the schema has them. OTLP writes ids in hexadecimal, where the JSON of Protobuf has base64."""
    request = json_format.Parse(body, ExportTraceServiceRequest())
    spans = [span for resource in request.resource_spans for scope in resource.scope_spans for span in scope.spans]
    for span, ours in zip(spans, spans_in(body)[0], strict=True):
        assert (span.name, span.kind, span.start_time_unix_nano, span.end_time_unix_nano) == (ours.name, ours.kind, ours.begin, ours.end), ours
        values = {entry.key: getattr(entry.value, entry.value.WhichOneof("value")) for entry in span.attributes}
        assert values == ours.attributes, (values, ours)
        assert (span.status.code == Status.STATUS_CODE_ERROR) == ours.error, ours
    (resource,) = request.resource_spans
    assert {entry.key for entry in resource.resource.attributes} >= {"service.name", "service.version", "service.instance.id"}
    return spans


def must_fail():
    """The check finds a field that the schema does not have, and a number where it has none."""
    for wrong in (b'{"resourceSpans":[{"scopeSpans":[{"spans":[{"nam":"x"}]}]}]}', b'{"resourceSpans":[{"scopeSpans":[{"spans":[{"startTimeUnixNano":"x"}]}]}]}'):
        try:
            json_format.Parse(wrong, ExportTraceServiceRequest())
        except json_format.ParseError:
            continue
        raise AssertionError(wrong)


def main():
    must_fail()
    service, collector = MeasuredService(sys.argv[1]), Collector()
    try:
        service.start_all()
        service.start_gateway("--otlp", collector.url)
        requests = []  # each is awaited: the gateway sends together what waits together
        for dataset, status in (("ball", 200), ("nothing", 404)):
            path = "/api/v1/render.png?" + urllib.parse.urlencode({"dataset": dataset, "size": 32})
            assert fetch(service.gateway, path, headers={"Authorization": f"Bearer {TOKEN}"})[0] == status
            requests.append(parse(collector.request()[2]))
        made = service.run("slabstream", "turntable", "ball.nrrd", "--local=2", "--frames", 2, "-o", "f%d.png", "--otlp", collector.url)
        assert (made.returncode, made.stderr) == (0, ""), made.stderr
        requests.append(parse(collector.request()[2]))
    finally:
        service.close()
        collector.close()
    kinds = {span.kind for spans in requests for span in spans}
    assert kinds == {Span.SPAN_KIND_SERVER, Span.SPAN_KIND_CLIENT, Span.SPAN_KIND_INTERNAL}, kinds
    print(f"OpenTelemetry's schema reads {len(requests)} requests with {sum(map(len, requests))} spans")


if __name__ == "__main__":
    main()
