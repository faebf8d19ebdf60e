#!/usr/bin/env bash
# Pin what requirements.in asks for: every package with its hashes, for any supported Python, without index addresses.
set -euo pipefail
cd "$(dirname "$0")"
tool=$(mktemp -d)
trap 'rm -rf "$tool"' EXIT
/usr/bin/python3 -m venv "$tool"
"$tool/bin/pip" install --quiet uv
"$tool/bin/uv" pip compile requirements.in --python-version 3.11 --universal --generate-hashes --no-emit-index-url \
  --no-emit-find-links --custom-compile-command packaging/lock.sh --quiet --output-file requirements.lock
