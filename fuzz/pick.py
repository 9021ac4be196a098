#!/usr/bin/env python3
"""Picks a small corpus out of what a long run found.

    fuzz/pick.py TARGET FOUND [OCTETS]

FOUND is the folder a run wrote to. libFuzzer chooses the inputs that reach every edge the seeds do not
reach; the smallest of them are copied to fuzz/corpus/TARGET, up to OCTETS (40000) together."""

import hashlib
import os
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent


def main():
    target, found = sys.argv[1], Path(sys.argv[2]).resolve()
    room = int(sys.argv[3]) if len(sys.argv) > 3 else 40_000
    corpus = HERE / "corpus" / target
    for old in corpus.glob("found-*"):
        old.unlink()
    with tempfile.TemporaryDirectory() as merged:
        for seed in corpus.iterdir():
            (Path(merged) / seed.name).write_bytes(seed.read_bytes())
        run = ["cargo", "fuzz", "run", target, merged, str(found)]
        flags = ["-set_cover_merge=1", "-use_value_profile=0", "-use_counters=0"]
        environment = os.environ | {"RUSTC_BOOTSTRAP": "1"}
        subprocess.run(run + ["--"] + flags, cwd=HERE, env=environment, check=True)
        new = [path.read_bytes() for path in Path(merged).iterdir() if not path.name.startswith("seed-")]
    for octets in sorted(new, key=lambda octets: (len(octets), octets)):
        if len(octets) > room:
            break
        room -= len(octets)
        name = "found-" + hashlib.sha1(octets).hexdigest()[:12]
        (corpus / name).write_bytes(octets)


main()
