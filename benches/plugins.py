#!/usr/bin/env python3
"""Whole-process times of plugins and formulas beside the same built-in measure, in one run.

Usage: plugins.py [NSIDE ...]        (default: 256)

LONGAN names the binary (default: target/release/longan), PLUGIN the example in Rust, built by
`cargo build --release --workspace`; the example in C is compiled here by cc. All take turns, and medians are printed, of
the wall clock and of the processors' time. The first job is the usual one, the second has a window for each pixel and so
little work for each that the measure itself counts most.
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time

LONGAN = os.environ.get("LONGAN", "target/release/longan")
PLUGIN = os.environ.get("PLUGIN", "target/release/liblongan_example_plugin.so")
ROUNDS = 15

JOBS = {"windows of 6 degrees to Nside 16": [], "each pixel by itself": ["--window", "0", "--thresholds", "0"]}


def times_of(*command):
    """Wall-clock and processor seconds of a process."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
    wall = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def compare(nside, folder):
    sky, out, in_c = (os.path.join(folder, name) for name in ("sky.fits", "out.fits", "axis_ratio.so"))
    subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-Imeasures/include", "examples/plugin-c/axis_ratio.c", "-o", in_c, "-lm"], check=True)
    waves = ["simulate", "waves", "-o", sky, "--nside", str(nside), "--correlation", "3", "--quiet", "--overwrite"]
    subprocess.run([LONGAN, *waves], check=True)
    ways = {
        "built-in": ["--measure", "evq"],
        "plugin in Rust": ["--plugin", PLUGIN, "--measure", "quotient"],
        "plugin in C": ["--plugin", in_c, "--measure", "quotient"],
        "formula": ["--measure", "quotient = (psi0.re + psi2)/(psi0.re - psi2)"],
    }
    for job, options in JOBS.items():
        times = {way: [] for way in ways}
        for _ in range(ROUNDS):
            for way, measure in ways.items():
                times[way].append(times_of(LONGAN, "map", sky, "-o", out, "--overwrite", "--quiet", *options, *measure))
        print(f"\nNside {nside}, {job}, {os.cpu_count()} processors\n")
        print("| EVQ as | seconds | of built-in | processor seconds | of built-in |")
        print("| --- | ---: | ---: | ---: | ---: |")
        medians = {way: [statistics.median(each) for each in zip(*runs)] for way, runs in times.items()}
        for way, (wall, processor) in medians.items():
            own = [wall / medians["built-in"][0], processor / medians["built-in"][1]]
            print(f"| {way} | {wall:.3f} | {own[0]:.2f} | {processor:.3f} | {own[1]:.2f} |", flush=True)


with tempfile.TemporaryDirectory() as folder:
    for argument in sys.argv[1:] or ["256"]:
        compare(int(argument), folder)
