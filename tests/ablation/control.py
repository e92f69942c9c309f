"""The control of the instrument: a reader that forgets an attribute again must be caught.

Each reversal takes back one known mend: in a copy of the sources a reader no longer finds the attribute. Its format is then run for the
paths that have the attribute's word; a failure must be there that was not there before.
"""
import dataclasses
import pathlib
import shutil
import subprocess

REPOSITORY = pathlib.Path(__file__).resolve().parent.parent.parent


@dataclasses.dataclass
class Reversal:
    """`before` stands once in `file`, a path from data/ on, and becomes `after`. `word`: part of the paths of nodes that must be caught."""
    format: str
    word: str
    file: str
    before: str
    after: str


def forgets(format_name, word, file, name=None):
    """The reader looks for an attribute of another name."""
    quoted = f'"{name or word}"'
    return Reversal(format_name, word, file, quoted, f'"{(name or word)[:-1]}~"')


REVERSALS = [
    Reversal("nifti", "xyzt_units", "volume_io/nifti_header.cpp", "at.unit", "at.unit + 1"),
]


class Copy:
    """The sources as they are now, in a folder of their own, with a build of observe_sources that is kept for the next run."""

    def __init__(self):
        self.tree = REPOSITORY / "build-ignored" / "control"
        listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=REPOSITORY, capture_output=True, check=True)
        for name in filter(None, listed.stdout.decode().split("\0")):
            self.take(name)

    def take(self, name):
        """A file of the repository, if it differs: what is the same is not compiled again."""
        source, target = REPOSITORY / name, self.tree / name
        if not source.is_file() or (target.is_file() and target.read_bytes() == source.read_bytes()):
            return
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, target)

    def build(self):
        """The program observe_sources."""
        build = self.tree / "build"
        if not (build / "build.ninja").is_file():
            subprocess.run(["cmake", "--preset", "release", "-DSLABSTREAM_UNITY=ON", "-DSLABSTREAM_NATIVE=ON", "-DSLABSTREAM_TESTS=ON",
                            "-DSLABSTREAM_BENCH=OFF"], cwd=self.tree, capture_output=True, check=True)
        made = subprocess.run(["cmake", "--build", str(build), "--target", "observe_sources", "slabstream-dicom-decoder"], capture_output=True, text=True,
                              check=False)
        if made.returncode != 0:
            raise RuntimeError(made.stdout[-3000:])
        return str(build / "tests" / "observe_sources")

    def revert(self, reversal):
        path = self.tree / "data" / reversal.file
        text = path.read_text()
        if text.count(reversal.before) != 1:
            raise RuntimeError(f"data/{reversal.file} has {reversal.before!r} {text.count(reversal.before)} times, must have it once")
        path.write_text(text.replace(reversal.before, reversal.after))


def run_control(failures_of):
    """`failures_of(program, format, word)`: the set of failures of a run. Prints a line for each reversal; the number that was missed."""
    copy = Copy()
    program = copy.build()
    known = {(r.format, r.word): failures_of(program, r.format, r.word) for r in REVERSALS}
    missed = 0
    for reversal in REVERSALS:
        copy.revert(reversal)
        try:
            new = failures_of(copy.build(), reversal.format, reversal.word) - known[reversal.format, reversal.word]
        finally:
            copy.take(f"data/{reversal.file}")
        missed += not new
        print(f"{'caught' if new else 'MISSED'}  {reversal.format} {reversal.word} (data/{reversal.file}): "
              + ("; ".join(f"{verdict} {path}" for verdict, path in sorted(new)[:3]) if new else "nothing noticed that it is passed over"), flush=True)
    print(f"control: {len(REVERSALS) - missed} of {len(REVERSALS)} reverted mends are caught")
    return missed
