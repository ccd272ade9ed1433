"""Tests of table 2's results by several processes: equal to those of one, and what is no whole set is refused."""

import json
import subprocess
import sys
import tempfile
import time
import unittest
from argparse import ArgumentTypeError
from pathlib import Path

import table_shards
from table_shards import Header

JOBS = [(kind, repeat) for kind in ("paper", "deployed") for repeat in range(5)]


def do(job):
    """A job whose result is a number with all its digits."""
    return json.dumps({"kind": job[0], "repeat": job[1], "found": [["svm", 1 / (3 + job[1])]]})


class Shards(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def shards(self, of, made_by="a"):
        files = [self.folder / f"{made_by}-{n}-of-{of}" for n in range(1, of + 1)]
        for n, file in enumerate(files, 1):
            table_shards.make(Header(n, of, made_by, JOBS), file, do, 2)
        return files

    def test_the_merged_results_equal_those_of_one_process(self):
        whole = self.folder / "whole"
        table_shards.run(JOBS, whole, do, 2)
        for of in (1, 3, 10):
            files = self.shards(of)
            self.assertEqual(table_shards.merged(files[::-1]).encode(), whole.read_bytes(), of)
        self.assertEqual([file.name for file in self.folder.iterdir() if "part" in file.name or "tmp" in file.name], [])

    def test_a_killed_process_leaves_no_shard_and_another_makes_the_rest(self):
        file = self.folder / "1"
        program = (
            "import sys, time; sys.path.insert(0, sys.argv[1]); import table_shards, test_table_shards as t;"
            "slow = lambda job: t.do(job) if job[0] == 'paper' else time.sleep(60);"
            "table_shards.make(table_shards.Header(1, 1, 'a', t.JOBS), table_shards.Path(sys.argv[2]), slow, 1)"
        )
        worker = subprocess.Popen([sys.executable, "-c", program, str(Path(__file__).parent), str(file)])
        part = None
        for _ in range(600):
            part = next(self.folder.glob("1.*.part"), None)
            if part and part.read_text().count("\n") == 5:
                break
            time.sleep(0.05)
        worker.kill()
        worker.wait()
        self.assertFalse(file.exists())
        # The line at which it was killed may be there in part.
        with part.open("a") as out:
            out.write('{"kind": "depl')
        done = []
        table_shards.make(Header(1, 1, "a", JOBS), file, lambda job: done.append(job) or do(job), 1)
        self.assertEqual(done, JOBS[5:])
        whole = self.folder / "whole"
        table_shards.run(JOBS, whole, do, 1)
        self.assertEqual(table_shards.merged([file]).encode(), whole.read_bytes())

    def refused(self, files, *parts):
        with self.assertRaises(SystemExit) as error:
            table_shards.merged(files)
        for part in parts:
            self.assertIn(part, str(error.exception))

    def test_what_is_no_whole_set_is_refused_by_name(self):
        one, two, three = self.shards(3)
        foreign = self.shards(3, "b")
        self.refused([one, three], "1 of 3 shards are missing", "2/3")
        self.refused([one, two, one], "is shard 1/3, as is", "expected each once")
        self.refused([one, foreign[1], three], "b-2-of-3: is of other sources or versions")
        self.refused([one, self.shards(2)[1]], "a-2-of-2: is of other jobs or number of shards")
        text = two.read_text()
        for damaged in (text[:-1], text.replace("0.2", "0.3", 1), f"{text}{{}}\n", text.partition("\n")[0]):
            two.write_text(damaged)
            self.refused([one, two, three], "a-2-of-3", "make it again")
        for other in ("", "[]", "{}", "no JSON\n"):
            two.write_text(other)
            self.refused([one, two, three], "a-2-of-3: is no shard")

    def test_a_shard_that_is_there_stays_and_another_file_too(self):
        one, two = self.shards(2)
        before = one.read_bytes()
        table_shards.make(Header(1, 2, "a", JOBS), one, lambda job: self.fail(job), 1)
        with self.assertRaises(SystemExit):
            table_shards.make(Header(2, 2, "a", JOBS), one, do, 1)
        self.assertEqual(one.read_bytes(), before)
        with self.assertRaises(SystemExit):
            table_shards.make(Header(1, 11, "a", JOBS), self.folder / "new", do, 1)

    def test_numbers_are_checked(self):
        self.assertEqual(table_shards.numbers("3/8"), (3, 8))
        for wrong in ("0/2", "3/2", "1", "1/", "-1/2", "1/2/3", "a/b"):
            with self.assertRaises(ArgumentTypeError):
                table_shards.numbers(wrong)


if __name__ == "__main__":
    unittest.main()
