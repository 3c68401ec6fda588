"""What the benchmarks measure of a process, and how."""

import subprocess
import sys
import time


def seconds_of(*command):
    """Wall-clock seconds of a process."""
    start = time.perf_counter()
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - start


def memory_of(*command):
    """Peak memory of a process in bytes, run from a small interpreter: a child counts its parent's memory too."""
    run = "import resource, subprocess, sys; subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, check=True); "
    show = "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    return 1024 * int(subprocess.check_output([sys.executable, "-c", run + show, *command]))
