"""A service on a fresh database, and what its aircraft send: shared by the scripts beside this file."""

import datetime
import http.client
import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
BINARY = Path(os.environ.get("ACTUARY", TARGET / "release" / "actuary")).resolve()
PART = "EMA-48V"
START = datetime.datetime.now(datetime.timezone.utc) - datetime.timedelta(days=20)


class Service:
    """`actuary serve` on loopback, gone with the script."""

    def __init__(self):
        self.folder = tempfile.TemporaryDirectory(prefix="actuary-hurt-")
        self.url = f"sqlite:{self.folder.name}/fleet.sqlite"

    def start(self):
        command = [BINARY, "serve", "--database-url", self.url, "--port", "0"]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().strip().removeprefix("listening on http://")
        if not self.address:
            raise SystemExit("the service does not start")
        return self

    def token(self, operator):
        """A token of an operator; from the first on, everyone has to show one."""
        command = [BINARY, "token", "create", "--operator", operator, "--scope", "admin", "--database-url", self.url]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()

    def memory_mb(self):
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(status.split("VmHWM:")[1].split()[0]) / 1024

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()
        self.folder.cleanup()


class Caller:
    """One connection, by which a token is shown."""

    def __init__(self, service, token=None):
        self.connection = http.client.HTTPConnection(service.address, timeout=120)
        self.headers = {"authorization": f"Bearer {token}"} if token else {}

    def ask(self, method, path, body=None, kind="application/json"):
        headers = self.headers | ({"content-type": kind} if body else {})
        self.connection.request(method, path, body, headers)
        answer = self.connection.getresponse()
        return answer.status, answer.read()

    def get(self, path):
        status, body = self.ask("GET", path)
        if status != 200:
            raise RuntimeError(f"GET {path}: {status} {body[:200]}")
        return json.loads(body)

    def mask(self):
        """Name and number of points of the mask to sample by."""
        active = next(model for model in self.get("/v1/models")["items"] if model["active"])
        mask = self.get(f"/v1/models/{active['hash']}/mask")
        return mask["mask_id"], len(mask["points"])

    def upload(self, tail, upload):
        """Seconds until it is acknowledged."""
        begun = time.monotonic()
        status, body = self.ask("POST", f"/v1/tails/{tail}/uploads", json.dumps(upload))
        if status not in (200, 202):
            raise RuntimeError(f"upload {upload['upload_id']}: {status} {body[:300]}")
        return time.monotonic() - begun


def upload(mask, name, serial, position, hours, minutes):
    """One upload of an actuator without a fault, so many minutes after the start."""
    mask_id, points = mask
    at = START + datetime.timedelta(minutes=minutes)
    return {
        "upload_id": name,
        "position": position,
        "part_number": PART,
        "serial_number": serial,
        "flight_hours": hours,
        "recorded_at": at.strftime("%Y-%m-%dT%H:%M:%SZ"),
        "mask_id": mask_id,
        "samples": [0.0752 + 1e-5 * ((7 * i + int(60 * hours)) % 13) for i in range(points)],
        "load_ratio": 0.11,
        "sample_noise": 0.01,
    }


def percentile(values, share):
    """The value below which this share lies."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else float("nan")
