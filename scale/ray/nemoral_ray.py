#!/usr/bin/env python3
"""Records a data set on a Ray cluster, shard by shard, and merges the shards.

    python nemoral_ray.py CONFIG --out forest --shards 64 --work /shared/folder

Ray hands out numbers only: shard I of N is a pure function of the config, so it does not matter who
makes it, how often, or in which order, and the result has the bytes of a single run. A shard whose
worker dies is continued by another one (`--resume`), if they share WORK, and begun again if not.

Needs `ray` (PyPI), and the program `nemoral` of the same version on every node.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import ray
from ray.exceptions import RayError

# The exit code of nemoral for a wrong request. After others, another try may help.
WRONG = 2


class WrongRequest(Exception):
    """The program refused the request: another try would be refused, too."""


def generate(program, config, arguments, out, shard):
    """Makes a shard in the folder `out`, or finishes it."""
    # A folder that is missing, empty or unfinished is continued alike.
    command = [program, "generate", config, *arguments]
    command += ["--shard", shard, "--out", out, "--resume", "--quiet"]
    ended = subprocess.run(command, capture_output=True, text=True)
    if ended.returncode == WRONG:
        raise WrongRequest(ended.stderr.strip())
    if ended.returncode != 0:
        raise RuntimeError(ended.stderr.strip() or f"{program} ended with {ended.returncode}")


@ray.remote(max_retries=-1, retry_exceptions=False)
def make(program, config, arguments, out, index, count):
    """Makes a shard on some node. A worker that dies is replaced by Ray."""
    began = time.monotonic()
    generate(program, config, arguments, out, f"{index}/{count}")
    return index, time.monotonic() - began, ray.get_runtime_context().get_node_id()[:8]


def run(args):
    """Makes all shards, and merges them."""
    work = Path(args.work)
    work.mkdir(parents=True, exist_ok=True)
    folders = [str(work / f"shard-{i}-of-{args.shards}") for i in range(args.shards)]
    options = {"num_cpus": args.cpus}
    request = (args.program, str(Path(args.config).resolve()), args.argument)

    def start(index):
        return make.options(**options).remote(*request, folders[index], index, args.shards)

    running = {start(i): i for i in range(args.shards)}
    tries = dict.fromkeys(range(args.shards), 1)
    done = 0
    began = time.monotonic()
    while running:
        [ready], _ = ray.wait(list(running), num_returns=1)
        index = running.pop(ready)
        try:
            _, seconds, node = ray.get(ready)
        except RayError as error:
            cause = getattr(error, "cause", None)
            if isinstance(cause, WrongRequest):
                for other in running:
                    ray.cancel(other, force=True)
                sys.exit(f"error: {cause}")
            tries[index] += 1
            if tries[index] > args.tries:
                sys.exit(f"error: shard {index} failed {args.tries} times: {cause or error}")
            report(event="retry", shard=index, reason=str(cause or type(error).__name__))
            running[start(index)] = index
            continue
        done += 1
        left = (time.monotonic() - began) / done * (args.shards - done)
        report(event="shard", shard=index, done=done, total=args.shards, node=node,
               seconds=round(seconds, 1), left_s=round(left))
    merge = [args.program, "merge", *folders, "--out", args.out, "--resume"]
    code = subprocess.run(merge).returncode
    if code != 0:
        sys.exit(code)
    if not args.keep:
        for folder in folders:
            shutil.rmtree(folder)


def report(**what):
    """A line of JSON on standard output."""
    print(json.dumps(what), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("config", help="the config, with absolute paths of files that it names")
    parser.add_argument("--out", required=True, help="the data set")
    parser.add_argument("--work", required=True, help="a folder for shards, which all nodes see")
    parser.add_argument("--shards", type=int, required=True)
    parser.add_argument("--cpus", type=float, default=2, help="processors of a shard")
    parser.add_argument("--tries", type=int, default=3, help="how often a failing shard is tried")
    parser.add_argument("--program", default=shutil.which("nemoral") or "nemoral")
    parser.add_argument("--address", default=os.environ.get("RAY_ADDRESS", "auto"))
    parser.add_argument("--keep", action="store_true", help="keeps the shards after the merge")
    parser.epilog = "After -- come further arguments of nemoral generate."
    # argparse does not tell what follows -- from other arguments without a name.
    words = sys.argv[1:]
    cut = words.index("--") if "--" in words else len(words)
    args = parser.parse_args(words[:cut])
    args.argument = words[cut + 1 :]
    if args.shards < 1:
        parser.error("--shards: must be at least 1")
    ray.init(address=args.address, log_to_driver=False)
    run(args)


if __name__ == "__main__":
    main()
