#!/usr/bin/env python3
"""Interrupts a run with Ctrl-C again and again, until it is complete, and prints how long the process took to
end, by phase.

    cancel_loop.py SKEP SCENE RUN [ARGUMENT ...]
"""

import pathlib
import random
import signal
import subprocess
import sys
import time


def last_phase(printed: str) -> str:
    """The phase that the last line of the progress names."""
    lines = [line for line in printed.splitlines() if " views: " in line]
    return lines[-1].split(",")[0] if lines else "before"


def main() -> None:
    skep, scene, run, *more = sys.argv[1:]
    command = [skep, "reconstruct", scene, "--output", run, "--preset", "fast", *more]
    random.seed(1)
    latencies: dict[str, list[float]] = {}
    log = pathlib.Path(run).with_suffix(".log")
    while True:
        with log.open("w") as file:
            process = subprocess.Popen(command, stderr=file, stdout=subprocess.DEVNULL)
            try:
                status = process.wait(random.uniform(0.5, 12))
            except subprocess.TimeoutExpired:
                sent = time.monotonic()
                process.send_signal(signal.SIGINT)
                status = process.wait()
                latencies.setdefault(last_phase(log.read_text()), []).append(time.monotonic() - sent)
        if status == 0:
            break
        if status != 130:
            sys.exit(f"exit status {status}: {log.read_text()}")
    for phase, times in latencies.items():
        worst, mean = 1000 * max(times), 1000 * sum(times) / len(times)
        print(f"cancel_loop: {phase}: {len(times)} times, {worst:.0f} ms at most, {mean:.0f} ms on average")


if __name__ == "__main__":
    main()
