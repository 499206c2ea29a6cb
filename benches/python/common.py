"""What the benchmarks of the Python package share."""

import os
import statistics
import time


def host():
    """A line that names the processor."""
    names = {}
    with open("/proc/cpuinfo", encoding="ascii") as file:
        for line in file:
            key, _, value = line.partition(":")
            names.setdefault(key.strip(), value.strip())
    family, model = names.get("cpu family", "?"), names.get("model", "?")
    return f"{names.get('model name', '?')}, family {family}, model {model}, {os.cpu_count()} cores"


def timed(work, *arguments):
    """What `work` returns, and the milliseconds that it took by the wall."""
    start = time.perf_counter()
    found = work(*arguments)
    return found, (time.perf_counter() - start) * 1e3


def quantiles(times_ms):
    """Median, 90 %, 99 % and the greatest, as a text."""
    ordered = sorted(times_ms)
    at = [ordered[min(len(ordered) - 1, int(len(ordered) * q))] for q in (0.9, 0.99)]
    median = statistics.median(ordered)
    return f"median {median:.2f}, 90 % {at[0]:.2f}, 99 % {at[1]:.2f}, most {ordered[-1]:.2f} ms"


def _status_mb(name):
    with open("/proc/self/status", encoding="ascii") as file:
        return next(int(line.split()[1]) for line in file if line.startswith(name)) / 1024


def resident_mb():
    """The memory that this process takes now, MB."""
    return _status_mb("VmRSS:")


def peak_mb():
    """The most memory that this process took until now, or since `forget_peak`, MB."""
    return _status_mb("VmHWM:")


def forget_peak():
    """From now on `peak_mb` is that of what follows."""
    with open("/proc/self/clear_refs", "w", encoding="ascii") as file:
        file.write("5")
