#!/usr/bin/python3
"""Check that every system header which the builds included belongs to a package that packaging/system.sh names, or that those depend on.

    packaging/headers.py [--packages FILE] FOLDER_OR_LIST ...

A FOLDER is one that ninja built in: it keeps what each compilation included. A LIST is a file with one header a line. FILE holds the
packages, one a line, instead of those that system.sh names. A machine that has grown holds packages which a new one lacks; a build
that uses one of them works here and fails there.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path


def included(place: Path) -> set[str]:
    """Real paths of the headers below /usr that a build included."""
    if place.is_dir():
        text = subprocess.run(["ninja", "-C", place, "-t", "deps"], capture_output=True, text=True, check=True).stdout
    else:
        text = place.read_text(encoding="utf-8")
    paths = {line.strip() for line in text.splitlines() if line.strip().startswith("/usr/")}
    return {str(real) for real in (Path(path).resolve() for path in paths) if real.is_file() and not str(real).startswith("/usr/local/")}


def owners(paths: Iterable[str]) -> dict[str, str]:
    """Package of each path; paths without one are not in it."""
    listed = sorted(paths)
    found: dict[str, str] = {}
    for begin in range(0, len(listed), 500):
        done = subprocess.run(["dpkg", "-S", *listed[begin:begin + 500]], capture_output=True, text=True, check=False)
        for line in done.stdout.splitlines():
            names, _, path = line.partition(": ")
            if path and not line.startswith("diversion "):
                found[path] = names.split(",")[0].split(":")[0]
    return found


def closure(names: Iterable[str]) -> set[str]:
    """`names` and all installed packages that they depend on, as dpkg knows them."""
    form = "${binary:Package}\t${Pre-Depends}, ${Depends}\t${Provides}\n"
    needs: dict[str, set[str]] = {}
    provided: dict[str, set[str]] = {}
    for line in subprocess.run(["dpkg-query", "-W", "-f", form], capture_output=True, text=True, check=True).stdout.splitlines():
        package, wanted, virtual = line.split("\t")
        name = package.split(":")[0]
        # All alternatives count that are installed: one of them is what satisfies the dependency here.
        needs[name] = {_bare(word) for word in re.split(r"[,|]", wanted) if word.strip()}
        for word in virtual.split(","):
            if word.strip():
                provided.setdefault(_bare(word), set()).add(name)
    reached: set[str] = set()
    ahead = [name for name in names if name]
    while ahead:
        name = ahead.pop()
        if name in reached:
            continue
        reached.add(name)
        ahead += [*needs.get(name, ()), *provided.get(name, ())]
    return reached


def _bare(word: str) -> str:
    return re.sub(r"[ (:].*", "", word.strip())


def foreign(places: Iterable[Path], packages: Iterable[str]) -> dict[str, str]:
    """For each package that the builds used and that is not among `packages` or what they need: one of its headers."""
    paths = set().union(*(included(place) for place in places))
    known = closure(packages)
    return {package: path for path, package in sorted(owners(paths).items()) if package not in known}


def main() -> int:
    """Exit code 1 and a line for each package that is missing in the list."""
    parser = argparse.ArgumentParser(description="packages of the headers that the builds included")
    parser.add_argument("--packages", type=Path)
    parser.add_argument("places", nargs="+", type=Path)
    given = parser.parse_args()
    here = Path(__file__).parent
    named = (given.packages.read_text(encoding="utf-8") if given.packages else
             subprocess.run([here / "system.sh", "--all"], capture_output=True, text=True, check=True).stdout)
    missing = foreign(given.places, named.split())
    for package, path in missing.items():
        print(f"dembark: the build includes {path} of package {package}, which packaging/system.sh does not name; add it there",
              file=sys.stderr)
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main())
