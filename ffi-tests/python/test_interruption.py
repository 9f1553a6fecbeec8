"""Progress and cancellation of long calls."""

import os
import signal
import subprocess
import sys
import threading
import time

import made
import numpy as np
import pytest
import skep


def test_progress_comes_in_the_callers_thread_and_grows(scene):
    told, threads = [], set()

    def progress(progress):
        told.append(progress)
        threads.add(threading.get_ident())

    skep.reconstruct(
        scene,
        skep.Options(
            schedule_scales=made.TWO_SCALES,
            threads=2,
        ),
        progress,
    )
    assert threads == {threading.get_ident()}
    done = [progress.done for progress in told]
    assert done == sorted(done) and 0 <= done[0] and done[-1] <= 1
    assert {progress.downscale for progress in told} <= {1, 2}
    assert all(isinstance(progress.phase, skep.Phase) for progress in told)
    assert all(progress.view < progress.view_count == len(scene) for progress in told)


def test_cancel_is_the_only_answer_that_cancels(scene):
    with pytest.raises(skep.Cancelled) as caught:
        skep.reconstruct(scene, made.slow_options(), lambda progress: skep.CANCEL)
    assert caught.value.status == skep.Cancelled.status
    assert repr(skep.CANCEL) == "skep.CANCEL"
    # What functions return that show progress, as tqdm's update, which returns True when it drew.
    answers = iter([True, 1, "cancel", object()])
    quick = skep.Options(schedule_scales=made.TWO_SCALES, threads=2)
    assert len(skep.reconstruct(scene, quick, lambda progress: next(answers, True))) == len(scene)


def test_an_exception_cancels_and_is_raised(scene):
    class Own(Exception):
        pass

    def progress(progress):
        raise Own("of the caller")

    with pytest.raises(Own, match="of the caller"):
        skep.reconstruct(scene, made.slow_options(), progress)


def test_a_step_can_be_cancelled(scene):
    stepper = skep.Stepper(scene, made.slow_options())
    with pytest.raises(skep.Cancelled):
        stepper.search(0, 0, progress=lambda progress: skep.CANCEL)


INTERRUPTED = """
import signal, sys, threading
sys.path.insert(0, sys.argv[1])
import made, skep
# A shell that runs the tests in the background has them ignore Ctrl-C.
signal.signal(signal.SIGINT, signal.default_int_handler)
before = signal.getsignal(signal.SIGINT)
told = []
def progress(progress):
    if not told:
        print("running", flush=True)
    told.append(progress)
try:
    skep.reconstruct(made.scene(), made.slow_options(), progress if sys.argv[2] == "progress" else None)
except KeyboardInterrupt:
    assert signal.getsignal(signal.SIGINT) is before
    assert threading.active_count() == 1
    print("interrupted", flush=True)
# The interpreter and the library still work.
assert len(skep.Scene()) == 0
"""


@pytest.mark.parametrize("way", ["progress", "silent"])
def test_ctrl_c_stops_a_run_at_once(way):
    command = [sys.executable, "-c", INTERRUPTED, os.path.dirname(__file__), way]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        if way == "progress":
            assert process.stdout.readline() == "running\n"
        else:
            wait_until_it_works(process.pid)
        sent = time.monotonic()
        process.send_signal(signal.SIGINT)
        assert process.stdout.readline() == "interrupted\n"
        assert time.monotonic() - sent < 1.0
        assert process.wait(timeout=10) == 0


def wait_until_it_works(process: int) -> None:
    """Waits until the library's threads work: Python, the call, and the threads of the search."""
    while len(os.listdir(f"/proc/{process}/task")) < 4:
        time.sleep(0.01)
    time.sleep(0.3)


def test_a_signal_handler_runs_while_the_library_works(scene):
    """Handlers that raise cancel the run; others are called, and the run continues."""
    heard = []

    class Alarm(Exception):
        pass

    def handler(number, frame):
        heard.append(number)
        if len(heard) == 2:
            raise Alarm

    before = signal.signal(signal.SIGALRM, handler)
    signal.setitimer(signal.ITIMER_REAL, 0.2, 0.2)
    try:
        with pytest.raises(Alarm):
            skep.reconstruct(scene, made.slow_options())
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert len(heard) >= 2


def test_python_runs_on_while_the_library_works(scene):
    """The interpreter's lock is free: this thread counts while another is in the library."""
    counted, stop = 0, threading.Event()

    def work():
        try:
            skep.reconstruct(
                scene, made.slow_options(), lambda progress: skep.CANCEL if stop.is_set() else None
            )
        except skep.Cancelled:
            pass

    thread = threading.Thread(target=work)
    thread.start()
    for _ in range(100_000):
        counted += 1
    assert counted == 100_000 and thread.is_alive()
    stop.set()
    thread.join()


def test_runs_of_several_threads_give_the_same_bits_and_each_its_own_error(scene):
    options = skep.Options(schedule_scales="downscale=1 food_sources=3 iterations=1+1x1", threads=1)
    found, failures = {}, {}

    def work(number):
        found[number] = skep.reconstruct(scene, options)[0].depth
        try:
            scene.set_depth_range(number + 100, (1.0, 2.0))
        except skep.ArgumentError as failure:
            failures[number] = str(failure)

    threads = [threading.Thread(target=work, args=(number,)) for number in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(found[0], depth) for depth in found.values()) and len(found) == 3
    assert all(str(number + 100) in text for number, text in failures.items()) and len(failures) == 3
