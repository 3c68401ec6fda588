#!/usr/bin/env python3
"""Whole-process times of `longan regrid` beside `cdo remapcon`, and of a year of daily steps.

Usage: regrid.py [STEPS]        (default: 365)

Needs cdo, and nccopy for the file whose chunks hold several steps. LONGAN names the binary (default:
target/release/longan). One field of 1440 x 721 cells in single precision goes to Nside 256, and with cdo to a grid of
1440 x 720 cells between them; both compute their weights anew, take turns, and medians are printed. Times hold reading
and writing. A series goes through `longan map`, beside the time for as many files of one step each.
"""

import os
import subprocess
import sys
import tempfile
from statistics import median

from processes import memory_of, seconds_of

LONGAN = os.environ.get("LONGAN", "target/release/longan")
ROUNDS = 5

TARGET = """gridtype = lonlat
xsize = 1440
ysize = 720
xfirst = 0.125
xinc = 0.25
yfirst = -89.875
yinc = 0.25
"""


def cdo(*words):
    subprocess.run(["cdo", "-s", "-f", "nc4", "-b", "F32", *words], check=True)


def report(title, jobs, rounds, unit=1):
    """Runs jobs in turns; prints medians, and the peak memory of each."""
    memory = {name: memory_of(*job) for name, job in jobs.items()}
    times = {name: [] for name in jobs}
    for _ in range(rounds):
        for name, job in jobs.items():
            times[name].append(seconds_of(*job))
    print(f"\n{title}, {os.cpu_count()} processors\n")
    print("| job | seconds | a step | peak memory, MiB |")
    print("| --- | ---: | ---: | ---: |")
    for name, runs in times.items():
        seconds = median(runs)
        print(f"| {name} | {seconds:.3f} | {seconds / unit:.4f} | {memory[name] / 2**20:.0f} |", flush=True)


def main(folder, steps):
    path = lambda name: os.path.join(folder, name)
    with open(path("target.txt"), "w") as file:
        file.write(TARGET)
    cdo("-settaxis,2001-01-01,12:00:00,1day", "-topo,r1440x721", path("one.nc"))
    jobs = {
        "longan regrid, conservative, Nside 256": [LONGAN, "regrid", path("one.nc"), "-o", path("out.nc"), "--nside", "256"],
        "longan regrid, conservative, Nside 256, single precision": [
            LONGAN, "regrid", path("one.nc"), "-o", path("out32.nc"), "--nside", "256", "--float32",
        ],
        "cdo remapcon, 1440 x 720": ["cdo", "-s", "-O", f"remapcon,{path('target.txt')}", path("one.nc"), path("cdo.nc")],
    }
    jobs = {name: job + ["--overwrite", "--quiet"] if job[0] == LONGAN else job for name, job in jobs.items()}
    report("One step of 1440 x 721", jobs, ROUNDS)

    # Each step differs from the others, so that none is cheaper than it should be.
    days = ["-settaxis,2001-01-01,12:00:00,1day", f"-duplicate,{steps}", path("one.nc")]
    cdo("-expr,topo=topo*(2+sin(ctimestep()))", *days, path("year.nc"))
    files = {"uncompressed": "year.nc"}
    chunks = "time/73,lat/103,lon/144"
    subprocess.run(["nccopy", "-4", "-d", "1", "-c", chunks, path("year.nc"), path("chunked.nc")], check=True)
    files["compressed in chunks of 73 steps"] = "chunked.nc"
    job = lambda command, name, *words: [
        LONGAN, command, path(name), "-o", path("out.nc"), "--overwrite", "--quiet", "--nside", "256", *words,
    ]
    jobs = {"longan map of one step": job("map", "one.nc"), "longan regrid of one step": job("regrid", "one.nc", "--float32")}
    report("One step", jobs, ROUNDS)
    jobs = {f"longan map, {what}": job("map", name) for what, name in files.items()}
    jobs |= {f"longan regrid to single precision, {what}": job("regrid", name, "--float32") for what, name in files.items()}
    jobs |= {f"reading alone (cdo infon), {what}": ["cdo", "-s", "infon", path(name)] for what, name in files.items()}
    report(f"{steps} steps", jobs, 1, steps)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        main(folder, int(sys.argv[1]) if len(sys.argv) > 1 else 365)
