"""One data map against 99 simulations, as in the paper: `longan compare --work` beside `longan map` of one map.

    python3 benches/ensemble.py [NSIDE]

makes 100 skies (Nside 512 unless said otherwise), maps one of them by itself (the median of several runs), then compares
it with the others, their Minkowski maps made on the way (13 thresholds, windows of 6 degrees, Nside 16), and prints
seconds, the ratio of the two and the peak memory. LONGAN names the program (target/release/longan).
"""

import os
import sys
import tempfile
from statistics import median

from processes import memory_of, seconds_of

LONGAN = os.environ.get("LONGAN", "target/release/longan")
SIMULATIONS = 99
ROUNDS = 9


def main():
    nside = sys.argv[1] if len(sys.argv) > 1 else "512"
    with tempfile.TemporaryDirectory() as folder:
        path = lambda name: os.path.join(folder, name)
        skies = [path(f"sky{seed}.fits") for seed in range(1 + SIMULATIONS)]
        for seed, sky in enumerate(skies):
            waves = [LONGAN, "simulate", "waves", "--nside", nside, "--correlation", "1", "--seed", str(seed)]
            seconds_of(*waves, "--quiet", "-o", sky)
        one = [LONGAN, "map", "--quiet", "--overwrite", skies[0], "-o", path("one.fits")]
        alone = median(seconds_of(*one) for _ in range(ROUNDS))
        compare = [LONGAN, "compare", "--overwrite", *skies, "-o", path("deviation.fits"), "--work"]
        seconds = seconds_of(*compare, path("work"))
        print(f"\nNside {nside}, {SIMULATIONS} simulations, {os.cpu_count()} processors\n")
        print("| job | seconds | of one map | peak memory, MB |")
        print("| --- | ---: | ---: | ---: |")
        print(f"| longan map, one map | {alone:.3f} | 1.0 | {memory_of(*one) / 1e6:.0f} |")
        memory = memory_of(*compare, path("again")) / 1e6
        print(f"| longan compare, {1 + SIMULATIONS} maps | {seconds:.1f} | {seconds / alone:.1f} | {memory:.0f} |")


if __name__ == "__main__":
    main()
