#!/usr/bin/env python3
"""Finds what readers pass over (deploy/check ignored): changes what files say, one thing at a time, and looks whether anything notices.

Samples are written by other programs' libraries, which also enumerate what a sample says. Each thing (a node) is changed in at most six
ways. What Slabstream then makes of the file is compared with what it made before, and with what the foreign reader makes of it:

  used      something changed, and the foreign reader agrees (or does not read it)
  refused   an error names the node
  told      a note or a line of the log names the node
  harmless  nothing changed, and a row of data/*/harmless.tsv says why that is right
  ignored   nothing changed
  wrong     the foreign reader has other values or places
  unnamed   an error or a note that does not name the node
  crashed   the process ended or hung
  skipped   the time of the format was over

The last five are failures, and so is a row of harmless.tsv that is not needed. Exit status 1 if there was one.
"""
import argparse
import collections
import importlib
import itertools
import pathlib
import random
import shutil
import sys
import tempfile
import time

import numpy as np

from ablation import CannotWrite, Change, Node, changes_of, same_value
from control import run_control
from foreign_reader import ForeignReader
from judge import difference, judge
from observer import Observer

HERE = pathlib.Path(__file__).resolve().parent
FORMATS = sorted(path.stem for path in (HERE / "formats").glob("[a-z]*.py"))
VERDICTS = ("used", "refused", "told", "harmless", "ignored", "wrong", "unnamed", "crashed", "skipped")
FAILURES = VERDICTS[4:]
PAIR_ROLES = ("scale", "offset", "fill", "unit", "spacing", "affine")
MOST_PAIR_NODES = 12
MOST_SAMPLES = 12  # in which a change is tried until somebody notices it


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True, help="observe_sources; of --control, those that it builds itself")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="default: the time")
    parser.add_argument("--format", action="append", choices=FORMATS, help="only these; may be repeated")
    parser.add_argument("--minutes", type=float, default=15, help="for each format (default 15)")
    parser.add_argument("--summary", action="store_true", help="the table alone")
    parser.add_argument("--control", action="store_true", help="revert known mends of readers one by one, and look whether each is caught")
    parser.add_argument("--list", metavar="FILE", help="write each failure to this file, a line each, with tabs")
    return parser.parse_args()


class Row:
    """A row of harmless.tsv: a path that may be ignored, or all nodes of a kind: nifti/@comment."""

    def __init__(self, path, reason, source):
        self.path, self.reason, self.source, self.used = path, reason, source, False


def rows_of(format_name):
    """Those of all readers that begin with the format's name."""
    rows = {}
    for file in sorted((HERE.parent.parent / "data").glob("**/harmless.tsv")):
        for line in file.read_text().splitlines():
            if line and not line.startswith("#") and line.split("/")[0] == format_name:
                path, reason, source = line.split("\t")
                rows[path] = Row(path, reason, source)
    return rows


def is_whole(answer):
    """Foreign readers answer to odd files with odd shapes."""
    placed = answer.places is None or all([len(places) for places in answer.places] == list(field.shape) for field in answer.fields.values())
    return placed and all(field.ndim == 3 and field.size > 0 for field in answer.fields.values())


class Site:
    """A node of a sample: where it is found again in a fresh copy."""

    def __init__(self, sample, document, number, node):
        self.sample, self.document, self.number, self.node = sample, document, number, node


class FormatRun:
    """`word`: only nodes with it in their path are changed."""

    def __init__(self, name, options, folder, word=""):
        self.name, self.folder, self.word = name, folder, word
        self.module = importlib.import_module(f"formats.{name}")
        self.random = random.Random(f"{options.seed} {name}")
        self.observer = Observer(options.program, folder)
        self.end = time.monotonic() + options.minutes * 60
        self.rows = rows_of(name)
        self.counts = collections.Counter()
        self.failures = collections.defaultdict(list)  # (verdict, path) -> texts
        self.samples, self.before, self.answers, self.reader = [], {}, {}, None
        self.noticed = collections.defaultdict(list)  # (path, sample) -> names of changes that somebody noticed
        self.names = {}  # (sample, number of a document) -> the first words of its paths
        self.nodes = self.changes = self.unwritable = 0

    def places(self):
        return np.random.default_rng(1)  # the same places before and after

    def work(self, sample):
        """A fresh copy of a sample, always in the same place: messages have the same paths."""
        work = self.folder / "work"
        shutil.rmtree(work, ignore_errors=True)
        shutil.copytree(self.folder / "samples" / sample.name, work, symlinks=True)
        return work

    def fail(self, verdict, path, text):
        self.counts[verdict] += 1
        self.failures[verdict, path].append(text)

    def foreign(self, sample, work):
        if sample.read is None:
            return None
        try:
            answer = self.reader.read(sample.name, work) if self.reader else sample.read(work)
        except Exception:  # whatever a library raises: it refuses the file
            return None
        return answer if answer is not None and is_whole(answer) else None

    def make_samples(self):
        samples = self.module.samples(self.folder)
        self.reader = ForeignReader(samples) if getattr(self.module, "FOREIGN_READER_CRASHES", False) else None
        for sample in samples:
            made = self.folder / "samples" / sample.name
            made.mkdir(parents=True)
            sample.write(made)
            work = self.work(sample)
            before, again = self.observer.observe(work, sample.source), self.observer.observe(work, sample.source)
            answer = self.foreign(sample, work)
            self.before[sample.name], self.answers[sample.name] = before, answer
            path = f"{self.name} {sample.name}"
            if before.error or before.broken:
                self.fail("wrong", path, f"the sample itself is refused: {before.error or before.broken}")
                continue
            if not before == again:
                self.fail("wrong", path, "read twice, it differs")
            if sample.read is not None and answer is None:
                self.fail("wrong", path, "the foreign reader refuses the sample itself")
            elif answer is not None and (said := difference(before, answer, self.places())):
                self.fail("wrong", path, f"the sample itself: {said}")
                self.answers[sample.name] = None  # said once, and not of each change
            self.samples.append(sample)

    def sites(self):
        """For each path the samples that have it, all values, and the documents."""
        sites, values, documents = collections.defaultdict(list), collections.defaultdict(list), collections.defaultdict(set)
        for sample in self.samples:
            for number, document in enumerate(sample.documents(self.work(sample))):
                nodes = document.nodes()
                self.names[sample.name, number] = {node.path.split("/")[0] for node in nodes}
                for index, node in enumerate(nodes):
                    path = f"{self.name}/{node.path}"
                    if self.word not in path:
                        continue
                    if all(site.sample is not sample for site in sites[path]):
                        sites[path].append(Site(sample, number, index, node))
                    documents[node.path].add((sample.name, number))
                    if not any(same_value(node.value, value) for value in values[path]):
                        values[path].append(node.value)
        return sites, values, documents

    def apply(self, sample, makes):
        """Changes a fresh copy: (document, act on it) pairs. None: it cannot be written."""
        work = self.work(sample)
        try:
            documents = sample.documents(work)
            for number, make in makes:
                make(documents[number])
            for number in sorted({number for number, _ in makes}):
                documents[number].save()
        except Exception:  # whatever a library raises: it does not write such a file
            return None
        return work

    def harmless(self, path, node):
        for row in (self.rows.get(path), self.rows.get(f"{self.name}/@{node.kind}") if node.kind else None):
            if row is not None:
                row.used = True
                return True
        return False

    def verdict(self, sample, node, change, work, other=None):
        """`other`: what is compared instead of the sample as it was, of a pair: with one of both changes alone."""
        after = self.observer.observe(work, sample.source)
        before = other or self.before[sample.name]
        answer = None if after.error or after.broken else self.answers[sample.name] and self.foreign(sample, work)
        return judge(node, change, before, after, answer, self.places())

    def count(self, path, node, change, sample, verdict, why):
        if verdict in ("ignored", "wrong") and self.harmless(path, node):
            verdict = "harmless"
        if verdict in FAILURES:
            self.fail(verdict, path, f"{change.name} ({sample.name}){': ' + why if why else ''}")
        else:
            self.counts[verdict] += 1
        return verdict

    def late(self, path, change):
        """Whether the format's time is over."""
        self.changes += 1
        if time.monotonic() <= self.end:
            return False
        self.fail("skipped", path, change.name)
        return True

    def act(self, site, name):
        """The change of this name, of the node as a fresh document has it."""
        def make(document):
            node = document.nodes()[site.number]
            for change in changes_of(node, self.mined(node)):
                if change.name == name:
                    return change.make()
            raise CannotWrite(name)
        return make

    def mined(self, node):
        return [value for value in self.values[f"{self.name}/{node.path}"] if value is not None]

    def singles(self, sites):
        for path, listed in sites.items():
            self.nodes += 1
            for change in changes_of(listed[0].node, self.mined(listed[0].node)):
                if not self.late(path, change):
                    self.single(path, listed[:MOST_SAMPLES], change)

    def single(self, path, listed, change):
        """In the first sample that has the node; where nobody notices there, in the next: a spacing counts where no matrix does. What must
        not depend on the sample has a name of its own in each, by the name of its document."""
        first = None
        for site in listed:
            work = self.apply(site.sample, [(site.document, self.act(site, change.name))])
            if work is None:
                continue
            verdict, why = self.verdict(site.sample, site.node, change, work)
            first = first or (site, verdict, why)
            if verdict != "ignored":
                first = (site, verdict, why)
                break
        if first is None:
            self.unwritable += 1
            return
        site, verdict, why = first
        if self.count(path, site.node, change, site.sample, verdict, why) in ("used", "told") and not change.same:
            self.noticed[path, site.sample.name].append(change.name)

    def added(self, sites, documents):
        """What the documents of other samples say, and this one does not."""
        for path, listed in sites.items():
            node = listed[0].node
            for sample in self.samples:
                number = self.room_for(sample, node, documents)
                if number is None:
                    continue
                change = Change("added", None)
                work = None if self.late(path, change) else self.apply(sample, [(number, lambda d, n=node: d.add(n.path, n.value))])
                if work is not None:
                    self.count(path, node, change, sample, *self.verdict(sample, node, change, work))
                break

    def room_for(self, sample, node, documents):
        """The number of a document that can say what it lacks; None: there is none."""
        of_sample = [number for name, number in self.names if name == sample.name]
        rooms = [n for n in of_sample if node.path.split("/")[0] in self.names[sample.name, n] and (sample.name, n) not in documents[node.path]]
        if not rooms:
            return None
        opened = sample.documents(self.work(sample))
        for number in rooms:
            try:
                opened[number].add(node.path, node.value)
                return number
            except Exception:  # there is no place for it in this sample
                continue
        return None

    def sidecars(self):
        for sample in self.samples:
            for name in () if self.word else sample.sidecars:
                node, change = Node(f"sidecar/{name}", None), Change("dropped", None)
                self.nodes += 1
                if self.late(f"{self.name}/{node.path}", change):
                    continue
                work = self.work(sample)
                target = work / name
                shutil.rmtree(target) if target.is_dir() else target.unlink()
                self.count(f"{self.name}/{node.path}", node, change, sample, *self.verdict(sample, node, change, work))

    def pairs(self, sites):
        """Two changes at a time that were noticed, of one sample: the second must show, too."""
        by_sample = collections.defaultdict(list)
        for (path, sample), names in self.noticed.items():
            site = next(site for site in sites[path] if site.sample.name == sample)
            if site.node.role in PAIR_ROLES:
                by_sample[sample].append((path, site, names))
        for listed in by_sample.values():
            self.random.shuffle(listed)
            for one, two in itertools.combinations(listed[:MOST_PAIR_NODES], 2):
                self.pair(*one, *two)

    def pair(self, path, site, names, other_path, other, other_names):
        first, second = self.random.choice(names), self.random.choice(other_names)
        change = Change(f"{first} + {second}", None)
        both = f"{path} + {other_path}"
        if self.late(both, change):
            return
        makes = [(site.document, self.act(site, first)), (other.document, self.act(other, second))]
        work = self.apply(site.sample, makes[:1])
        alone = self.observer.observe(work, site.sample.source)
        work = self.apply(site.sample, makes)
        if work is None or alone.error or alone.broken:
            self.unwritable += 1
            return
        self.count(both, other.node, change, site.sample, *self.verdict(site.sample, other.node, change, work, alone))

    def run(self):
        self.make_samples()
        sites, self.values, documents = self.sites()
        self.singles(sites)
        self.added(sites, documents)
        self.sidecars()
        self.pairs(sites)
        self.observer.close()
        if self.reader:
            self.reader.close()
        for row in self.rows.values():
            if not row.used and not self.word:
                self.fail("ignored", row.path, "its row of harmless.tsv is not needed")


def run_format(name, options, word=""):
    with tempfile.TemporaryDirectory(prefix="ablation") as folder:
        run = FormatRun(name, options, pathlib.Path(folder), word)
        run.run()
    return run


def failures_of(options):
    def failures(program, name, word):
        options.program = program
        found = run_format(name, options, word).failures
        return {(verdict, path, text) for (verdict, path), texts in found.items() for text in texts}
    return failures


def main():
    options = arguments()
    sys.path.insert(0, str(HERE))
    print(f"seed {options.seed}", flush=True)
    if options.control:
        return 1 if run_control(failures_of(options)) else 0
    print(f"{'format':16} {'samples':>7} {'nodes':>6} {'changes':>7} " + " ".join(f"{v:>8}" for v in VERDICTS), flush=True)
    failed, listed = 0, []
    for name in options.format or FORMATS:
        run = run_format(name, options)
        print(f"{name:16} {len(run.samples):7} {run.nodes:6} {run.changes - run.unwritable:7} " + " ".join(f"{run.counts[v]:8}" for v in VERDICTS), flush=True)
        for (verdict, path), texts in sorted(run.failures.items()):
            listed.append(f"{verdict}\t{path}\t{'; '.join(texts)}")
            if not options.summary:
                print(f"  {verdict} {path}: {'; '.join(texts)}", flush=True)
        failed += sum(run.counts[v] for v in FAILURES)
    if options.list:
        pathlib.Path(options.list).write_text("".join(line + "\n" for line in listed))
    print(f"{failed} failures")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
