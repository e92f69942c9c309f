"""What Slabstream makes of a source: one process of observe_sources, begun again when it ends or hangs."""
import json
import os
import pathlib
import select
import subprocess

import numpy as np

SECONDS = 20  # for one sample, which is small


class Observation:
    """facts, arrays by name, notes, and the error ("": it was read). `broken`: the process ended or hung instead."""

    def __init__(self, answer, arrays, folder, broken=""):
        hidden = lambda text: text.replace(str(folder), "FOLDER")
        self.facts = answer.get("facts", {})
        self.arrays = arrays
        self.notes = [hidden(note) for note in answer.get("notes", [])]
        self.error = hidden(answer.get("error", ""))
        self.broken = broken

    def same_data(self, other):
        """Facts and arrays are the same."""
        return (self.facts == other.facts and self.arrays.keys() == other.arrays.keys()
                and all(np.array_equal(a, other.arrays[name], equal_nan=True) for name, a in self.arrays.items()))

    def __eq__(self, other):
        return self.error == other.error and self.broken == other.broken and self.notes == other.notes and self.same_data(other)


class Observer:
    def __init__(self, program, folder):
        self.program, self.output = program, pathlib.Path(folder) / "arrays"
        self.process = None

    def _start(self):
        cache = self.output.parent / "cache"
        self.process = subprocess.Popen([self.program], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        env={**os.environ, "XDG_CACHE_HOME": str(cache), "XDG_RUNTIME_DIR": str(self.output.parent)})

    def observe(self, folder, source):
        if self.process is None or self.process.poll() is not None:
            self._start()
        request = json.dumps({"source": str(pathlib.Path(folder) / source), "output": str(self.output)}) + "\n"
        try:
            self.process.stdin.write(request.encode())
            self.process.stdin.flush()
            ready, _, _ = select.select([self.process.stdout], [], [], SECONDS)
            line = self.process.stdout.readline() if ready else b""
        except OSError:
            ready, line = True, b""
        if not line.endswith(b"\n"):
            self.close()
            return Observation({}, {}, folder, f"ended with {self.process.returncode}" if ready else f"no answer within {SECONDS} s")
        answer = json.loads(line)
        numbers = np.fromfile(self.output, np.float64)
        arrays, begin = {}, 0
        for name, count in answer["arrays"]:
            arrays[name], begin = numbers[begin:begin + count], begin + count
        return Observation(answer, arrays, folder)

    def close(self):
        if self.process is not None:
            self.process.kill()
            self.process.wait()
