"""Foreign readers that some files crash or hang: in a process of its own, which is begun again when it ends or hangs."""
import multiprocessing
import os

from observer import SECONDS


class ForeignReader:
    """Reads samples by name. The process is a copy of this one, so that what a library loads at its first file is loaded once."""

    def __init__(self, samples):
        self.reads = {sample.name: sample.read for sample in samples}
        self.process = self.pipe = None

    def _serve(self, pipe):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        while True:
            name, work = pipe.recv()
            try:
                answer = self.reads[name](work)
            except Exception:  # it refuses the file
                answer = None
            pipe.send(answer)

    def _start(self):
        fork = multiprocessing.get_context("fork")
        self.pipe, other = fork.Pipe()
        self.process = fork.Process(target=self._serve, args=(other,), daemon=True)
        self.process.start()
        other.close()

    def read(self, name, work):
        """None: it refuses the file, ends or hangs."""
        if self.process is None:
            self._start()
        try:
            self.pipe.send((name, work))
            if self.pipe.poll(SECONDS):
                return self.pipe.recv()
        except (EOFError, OSError):  # it has ended
            pass
        self.close()
        return None

    def close(self):
        if self.process is not None:
            self.process.kill()
            self.process.join()
            self.pipe.close()
            self.process = None
