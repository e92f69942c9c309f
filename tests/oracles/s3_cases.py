"""Arrays in buckets of S3: zarr-python writes them, boto3 puts them into moto's server, which checks the signature of each request.

Names have what must be encoded in addresses and signatures. The secret of some cases is wrong: those must be refused.
"""
import atexit
import logging
import os
import tempfile
import urllib.request

import boto3
import numpy as np
import zarr
from moto.server import ThreadedMotoServer

from case import Case, chunks, pick, sides, values

logging.getLogger("werkzeug").setLevel(logging.ERROR)  # moto's server tells of each request
CREDENTIALS = os.path.join(tempfile.mkdtemp(prefix="slabstream-s3-"), "credentials")
os.environ["AWS_SHARED_CREDENTIALS_FILE"] = CREDENTIALS  # of the readers, which start before there is a key
EVERYTHING = '{"Version": "2012-10-17", "Statement": [{"Effect": "Allow", "Action": "*", "Resource": "*"}]}'
LETTERS = "ab09-._~ +%&=,;:@$!*'()\u00fc\u6f22"


def write_credentials(key, secret):
    with open(CREDENTIALS, "w", encoding="utf-8") as file:
        file.write(f"[default]\naws_access_key_id = {key}\naws_secret_access_key = {secret}\n")


def start():
    """The server's address, an access key and its secret. From now on each request is checked."""
    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    atexit.register(server.stop)
    url = "http://{}:{}".format(*server.get_host_and_port())
    iam = boto3.client("iam", endpoint_url=url, region_name="us-east-1", aws_access_key_id="a", aws_secret_access_key="b")
    iam.create_user(UserName="reader")
    iam.put_user_policy(UserName="reader", PolicyName="all", PolicyDocument=EVERYTHING)
    key = iam.create_access_key(UserName="reader")["AccessKey"]
    headers = {"Content-Type": "text/plain"}
    urllib.request.urlopen(urllib.request.Request(f"{url}/moto-api/reset-auth", data=b"0", headers=headers, method="POST")).close()
    return url, key["AccessKeyId"], key["SecretAccessKey"]


def upload(client, folder, prefix):
    for parent, _, names in os.walk(folder):
        for name in names:
            path = os.path.join(parent, name)
            client.upload_file(path, "bucket", f"{prefix}/{os.path.relpath(path, folder)}")


def cases(folder, random, count):
    url, key, secret = start()
    client = boto3.client("s3", endpoint_url=url, region_name="us-east-1", aws_access_key_id=key, aws_secret_access_key=secret)
    client.create_bucket(Bucket="bucket")
    for number in range(count):
        array = values(random, sides(random, "zyx"), pick(random, ["uint8", "uint16", "float32"]))
        shape = chunks(random, array.shape)
        shards = {"shards": tuple(2 * side for side in shape)} if random.random() < 0.5 else {}
        written = zarr.create_array(os.path.join(folder, f"{number}.zarr"), shape=array.shape, dtype=array.dtype, chunks=tuple(shape), **shards)
        written[:] = array
        name = "".join(LETTERS[i] for i in random.integers(0, len(LETTERS), 12))
        prefix = f"{number}/x{name}x.zarr"  # no part of it is "." or ".."
        upload(client, written.store.root, prefix)
        is_wrong = number % 8 == 7
        write_credentials(key, secret[::-1] if is_wrong else secret)
        title = f"s3 {array.dtype} {array.shape} {'sharded' if shards else 'in chunks'}"
        yield Case(title, f"s3://bucket/{prefix}?endpoint={url}", [np.asarray(written)], refused="HTTP 403" if is_wrong else "")
