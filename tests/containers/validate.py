"""Checks rendered manifests, on standard input, against the schemas of Kubernetes, and what no schema knows: that a pod may be longer in
ending than its worker drains, that its memory is more than what the program may take, that ports have the names that Services and probes
use, and that the Secret's keys exist. Arguments: the keys of the Secret slabstream-keys. Prints how many manifests are right, and the kinds
that Kubernetes itself does not know."""

import re
import sys

import kubernetes_validate
import yaml

VERSIONS = ("1.25", "1.30", "1.37")
UNITS = {"M": 2**20, "G": 2**30, "Mi": 2**20, "Gi": 2**30}  # of --memory, and of Kubernetes


def size(text):
    number, unit = re.fullmatch(r"(\d+)(\D+)", text).groups()
    return int(number) * UNITS[unit]


def check_pod(name, pod, secret_keys):
    """Yields what is wrong."""
    for volume in pod["volumes"]:
        for item in volume.get("secret", {}).get("items", []):
            if item["key"] not in secret_keys:
                yield f"{name}: the Secret has no {item['key']}"
    for container in pod["containers"]:
        options = dict(arg[2:].split("=", 1) for arg in container["args"] if "=" in arg)
        resources = container["resources"]
        if "memory" in options and size(options["memory"]) * 5 // 4 > size(resources["limits"]["memory"]):
            yield f"{name}: --memory={options['memory']} leaves too little of {resources['limits']['memory']}"
        if "threads" in options and options["threads"] != resources["requests"]["cpu"] and resources["requests"]["cpu"].isdigit():
            yield f"{name}: --threads={options['threads']} for {resources['requests']['cpu']} cores"
        if "drain" in options and int(options["drain"].rstrip("s")) >= pod.get("terminationGracePeriodSeconds", 30):
            yield f"{name}: --drain={options['drain']} is not less than the pod's grace period"
        if not container["securityContext"]["readOnlyRootFilesystem"] or not pod["securityContext"]["runAsNonRoot"]:
            yield f"{name}: runs as root or writes to its root"
        ports = {port["name"] for port in container.get("ports", [])}
        for probe in ("readinessProbe", "livenessProbe"):
            check = container.get(probe, {})
            port = check.get("httpGet", check.get("tcpSocket", {})).get("port")
            if isinstance(port, str) and port not in ports:
                yield f"{name}: {probe} asks the port {port}"


def main():
    manifests = [manifest for manifest in yaml.safe_load_all(sys.stdin) if manifest]
    unknown, wrong = set(), []
    for manifest in manifests:
        name = f"{manifest['kind']} {manifest['metadata']['name']}"
        for version in VERSIONS:
            try:
                kubernetes_validate.validate(manifest, version, strict=True)
            except kubernetes_validate.SchemaNotFoundError:
                unknown.add(manifest["kind"])
            except kubernetes_validate.ValidationError as error:
                wrong.append(f"{name}: {version}: {error.message}")
        if manifest["kind"] == "Deployment":
            template = manifest["spec"]["template"]
            wrong += check_pod(name, template["spec"], set(sys.argv[1:]))
            if manifest["spec"]["selector"]["matchLabels"] != template["metadata"]["labels"]:
                wrong.append(f"{name}: selects other pods than its own")
    for line in wrong:
        print(line, file=sys.stderr)
    extra = f"; no schema is at hand for {', '.join(sorted(unknown))}" if unknown else ""
    print(f"{len(manifests)} manifests, for Kubernetes {', '.join(VERSIONS)}{extra}")
    sys.exit(bool(wrong))


main()
