#!/usr/bin/env python3
"""Whole-process times of longan beside healpy.smoothing and litchi, in one run.

Usage: peers.py [NSIDE ...]        (default: 512)

Needs healpy. LONGAN names the binary (default: target/release/longan); LITCHI that of litchi, which is left out
otherwise. Everything is timed on the same simulated sky, with 13 thresholds from -3 to 3 sigma and windows of 6 degrees
unless said otherwise; longan and healpy take turns, and medians are printed. Times of longan hold reading and writing; healpy's map is in memory
already, in an interpreter that has run it before.
"""

import os
import sys
import tempfile
import time

import healpy
import numpy
from processes import memory_of, seconds_of

LONGAN = os.environ.get("LONGAN", "target/release/longan")
LITCHI = os.environ.get("LITCHI")
ROUNDS = 5


def sky(nside):
    """A CMB-like sky: flat band powers with one acoustic peak, under a beam of three pixels."""
    numpy.random.seed(nside)
    l = numpy.arange(3 * nside)
    spectrum = numpy.zeros(3 * nside)
    spectrum[2:] = 1000 * 2 * numpy.pi / (l[2:] * (l[2:] + 1)) * (1 + 4 * numpy.exp(-(((l[2:] - 220) / 120) ** 2)))
    return healpy.synfast(spectrum, nside, fwhm=3 * healpy.nside2resol(nside))


def compare(nside, folder):
    values = sky(nside)
    path, out = os.path.join(folder, "sky.fits"), os.path.join(folder, "out.fits")
    healpy.write_map(path, values, dtype=numpy.float64, overwrite=True)
    full = ["--nside-out", str(nside)]
    jobs = {
        "longan map, EVQ": [],
        "longan map, EVQ, psi2 and rank4-mid": ["--measure", "evq,psi2,rank4-mid"],
        f"longan map, EVQ at Nside {nside // 16}": ["--nside-out", str(nside // 16)],
        f"longan map, EVQ at Nside {nside}": full,
    }
    if nside < 2048:
        jobs[f"longan map, EVQ at Nside {nside}, windows of 30°"] = [*full, "--window", "30"]
    jobs = {name: [LONGAN, "map", path, "-o", out, *options, "--overwrite", "--quiet"] for name, options in jobs.items()}
    memory = {name: memory_of(*job) for name, job in jobs.items()}
    times = {"healpy.smoothing": []} | {name: [] for name in jobs}
    healpy.smoothing(healpy.ud_grade(values, 64), fwhm=0.02)
    for _ in range(ROUNDS if nside < 2048 else 1):
        start = time.perf_counter()
        healpy.smoothing(values, fwhm=numpy.radians(1))
        times["healpy.smoothing"].append(time.perf_counter() - start)
        for turn in range(3):
            for name, job in jobs.items():
                if turn == 0 or "--nside-out" not in job:
                    times[name].append(seconds_of(*job))
    if LITCHI:
        limits = [values.mean() + sign * 3 * values.std() for sign in (-1, 1)]
        thresholds = ["--mint", str(limits[0]), "--maxt", str(limits[1]), "--numt", "13", "--linThresh"]
        job = ["-A", "0", "-B", "2", "-C", "1", "--evq", "--smoothRad", str(numpy.radians(6)), "--NsideOut", "16"]
        times["litchi, EVQ"] = [seconds_of(LITCHI, "-i", path, "-o", out, "--forceOutname", *job, *thresholds)]

    seconds = {name: numpy.median(runs) for name, runs in times.items()}
    print(f"\nNside {nside}, to Nside 16 unless said otherwise, {os.cpu_count()} processors\n")
    print("| job | seconds | of healpy.smoothing | of longan | peak memory, bytes a pixel |")
    print("| --- | ---: | ---: | ---: | ---: |")
    for name in times:
        shown = f"{memory[name] / (12 * nside**2):.0f}" if name in memory else ""
        own, peer = seconds[name] / seconds["longan map, EVQ"], seconds[name] / seconds["healpy.smoothing"]
        print(f"| {name} | {seconds[name]:.3f} | {peer:.3f} | {own:.2f} | {shown} |", flush=True)


with tempfile.TemporaryDirectory() as folder:
    for argument in sys.argv[1:] or ["512"]:
        compare(int(argument), folder)
