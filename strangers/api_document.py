"""A validator that we did not write reads the document of the page's API: is it OpenAPI 3.1?

Usage: api_document.py [PROGRAM]    PROGRAM (default: target/debug/codewheel) runs its demo meanwhile
       api_document.py --self-test [PROGRAM]    show that a broken copy is found out
"""

from __future__ import annotations

import copy
import json
import re
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path
from typing import Any

from openapi_spec_validator import OpenAPIV31SpecValidator

ROOT = Path(__file__).resolve().parents[1]


def document_of(program: Path) -> dict[str, Any]:
    """What the page of the demo answers."""
    command = [str(program), "--listen", "127.0.0.1:0"]
    with subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as served:
        try:
            assert served.stderr is not None
            for line in served.stderr:
                if page := re.search(r"page (http://\S+)", line):
                    address = f"{page[1]}/api/v1/openapi.json"
                    with urllib.request.urlopen(address, timeout=10) as answer:
                        return json.load(answer)
        finally:
            served.send_signal(signal.SIGINT)
            served.communicate(timeout=10)
    raise SystemExit(f"{program} has not said where its page is")


def errors_in(document: dict[str, Any]) -> list[str]:
    """What the validator finds wrong."""
    return [error.message for error in OpenAPIV31SpecValidator(document).iter_errors()]


def self_test(document: dict[str, Any]) -> list[str]:
    """The breakages that are not found out."""
    lost, unnamed = copy.deepcopy(document), copy.deepcopy(document)
    del lost["info"]["title"]
    path = next(path for path in unnamed["paths"] if "{" in path)
    for operation in unnamed["paths"][path].values():
        operation["parameters"] = []
    broken = {"no title": lost, "a path without its parameters": unnamed}
    return [f"not found out: {what}" for what, wrong in broken.items() if not errors_in(wrong)]


def main() -> int:
    arguments = sys.argv[1:]
    is_test = arguments[:1] == ["--self-test"]
    program = Path((arguments[is_test:] or [ROOT / "target/debug/codewheel"])[0])
    document = document_of(program)
    errors = self_test(document) if is_test else errors_in(document)
    for error in errors:
        print(f"FAILED {error}")
    if not errors:
        paths = len(document["paths"])
        print("ok     " + ("broken copies are found out" if is_test else f"{paths} paths, OpenAPI 3.1"))
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
