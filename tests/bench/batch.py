#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What `--batch` costs and survives, in one table: speed-up of two shards, overhead per job, ten
thousand jobs, kills at random moments.

    python3 tests/bench/batch.py [--build build/release] [--only overhead,many,kills,speedup]

Wall times mean something on a quiet machine alone; the load is printed with them."""
import argparse
import filecmp
import glob
import json
import os
import random
import resource
import shutil
import signal
import statistics
import subprocess
import tempfile
import time

ROWS = []


def note(what, measured, asked):
    ROWS.append((what, measured, asked))
    print(f"{what}: {measured} (asked: {asked})", flush=True)


class Bench:
    def __init__(self, program, folder):
        self.program, self.folder = program, folder
        self.clip = self.path("tiny.npz")
        self.call("export", "demo_drink", "-o", self.clip, "--end", "2", "--no-object")

    def path(self, name):
        return os.path.join(self.folder, name)

    def call(self, *arguments, check=True):
        result = subprocess.run([self.program, *arguments, "-q"], capture_output=True, text=True)
        if check and result.returncode != 0:
            raise SystemExit(f"{arguments}: {result.returncode} {result.stderr[-500:]}")
        return result

    def list_of(self, name, lines):
        with open(self.path(name), "w", encoding="utf-8") as file:
            file.write("\n".join(lines) + "\n")
        return self.path(name)

    def tiny(self, count):
        return self.list_of(f"tiny{count}.txt", [f"tiny.npz name=j{k}.npz" for k in range(count)])

    # Jobs that end at once, since their input is not there: what is left is everything but the work.
    def overhead(self, count=2000):
        listed = self.list_of("none.txt", [f"gone{k}.npz name=j{k}" for k in range(count)])
        begin = time.perf_counter()
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.call("export", "--batch", listed, "-o", self.path("none"), "--threads", "1", check=False)
        seconds = time.perf_counter() - begin
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        note("overhead per job", f"{1e3 * seconds / count:.2f} ms wall, {1e3 * cpu / count:.2f} ms CPU", "< 3 ms")

    def many(self, count=10_000):
        listed = self.tiny(count)
        command = [self.program, "export", "--batch", listed, "-o", self.path("many"), "-q"]
        for what in ("first run", "all done"):
            begin = time.perf_counter()
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
            _, status, usage = os.wait4(process.pid, 0)
            seconds = time.perf_counter() - begin
            cpu = usage.ru_utime + usage.ru_stime
            if status != 0:
                raise SystemExit(f"export --batch: status {status}")
            note(f"{count} jobs, {what}", f"{seconds:.1f} s wall, {cpu:.1f} s CPU, {usage.ru_maxrss / 1024:.0f} MB", "< 300 MB" + (", < 5 s" if what == "all done" else ""))

    def kills(self, count=400, kills=30, shards=4, seed=1):
        listed = self.tiny(count)
        self.call("export", "--batch", listed, "-o", self.path("whole"), "--threads", "1")
        rng, out, killed, rounds = random.Random(seed), self.path("killed"), 0, 0
        start = lambda k: subprocess.Popen([self.program, "export", "--batch", listed, "-o", out, "-q", "--threads", "1", "--shard", f"{k + 1}/{shards}"], stdout=subprocess.DEVNULL)
        running = [start(k) for k in range(shards)]
        while killed < kills:
            time.sleep(rng.uniform(0.05, 0.25))
            rounds += 1
            k = rng.randrange(shards)
            if running[k].poll() is None:
                running[k].send_signal(signal.SIGKILL)
                killed += 1
            running[k].wait()
            # A shard that had its time begins with nothing done, so that there is something to kill.
            if running[k].returncode == 0 and all(r.poll() == 0 for r in running):
                shutil.rmtree(out)
                running = [start(j) for j in range(shards)]
            else:
                running[k] = start(k)
        codes = [process.wait() for process in running]
        if any(codes):
            raise SystemExit(f"a shard ended with {codes}")
        done = {}
        for journal in glob.glob(os.path.join(out, ".jobs", "status.*.jsonl")):
            with open(journal, encoding="utf-8", errors="replace") as file:
                for line in file:
                    try:
                        name = json.loads(line)["name"]
                    except (ValueError, KeyError):
                        continue
                    done[name] = done.get(name, 0) + 1
        names = sorted(os.listdir(self.path("whole")))
        same = [n for n in names if n != ".jobs"] == [n for n in sorted(os.listdir(out)) if n != ".jobs"]
        _, differ, odd = filecmp.cmpfiles(self.path("whole"), out, [n for n in names if n != ".jobs"], shallow=False)
        twice = sum(times > 1 for times in done.values())
        note(f"{killed} kills, {count} jobs, {shards} shards", f"{len(differ) + len(odd)} files differ, same names: {same}, {count - len(done)} lost, {twice} done twice", "0, True, 0, 0")

    # By the clock and by processor time (of the one, by the longer of the two): what else runs here
    # lengthens the first alone. Starts go about the clip, so that costs do not follow the stride of
    # the shards. Memory and disk, when they are what is waited for, are in the first alone, too.
    def speedup(self, jobs=24, pairs=4):
        listed = self.list_of("fits.txt", [f"demo_drink {['mug', 'apple', 'bottle'][k % 3]} start={7 * k % 97} end={7 * k % 97 + 24} name=f{k}" for k in range(jobs)])
        ratios, fastest, least = [], {1: 1e9, 2: 1e9}, {1: 1e9, 2: 1e9}
        for pair in range(pairs):
            seconds = {}
            for shards in (1, 2):
                out = self.path(f"speed{shards}")
                shutil.rmtree(out, ignore_errors=True)
                begin = time.perf_counter()
                running = [subprocess.Popen([self.program, "fit", "--batch", listed, "-o", out, "-q", "--threads", "1", "--shard", f"{k + 1}/{shards}"], stdout=subprocess.DEVNULL) for k in range(shards)]
                ended = [os.wait4(process.pid, 0)[1:] for process in running]
                seconds[shards] = time.perf_counter() - begin
                if any(status for status, _ in ended):
                    raise SystemExit("a fit failed")
                fastest[shards] = min(fastest[shards], seconds[shards])
                least[shards] = min(least[shards], max(usage.ru_utime + usage.ru_stime for _, usage in ended))
            ratios.append(seconds[1] / seconds[2])
        note(f"{jobs} fits, two shards against one", f"{statistics.median(ratios):.2f} median of {[round(r, 2) for r in ratios]}, {fastest[1] / fastest[2]:.2f} of the fastest; {least[1] / least[2]:.2f} by processor time ({least[1]:.1f} s, {least[2]:.1f} s); load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores", ">= 1.9")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build/release")
    parser.add_argument("--only", default="overhead,many,kills,speedup")
    parser.add_argument("--fits", type=int, default=24, help="jobs of the speed-up's list")
    parser.add_argument("--pairs", type=int, default=4, help="how often the speed-up is measured")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="holdfast_batch.") as folder:
        bench = Bench(os.path.abspath(os.path.join(options.build, "apps/holdfast")), folder)
        for what in options.only.split(","):
            getattr(bench, what)(*([options.fits, options.pairs] if what == "speedup" else []))
    print("\n| | measured | asked |\n|---|---|---|")
    for row in ROWS:
        print("| " + " | ".join(row) + " |")


main()
