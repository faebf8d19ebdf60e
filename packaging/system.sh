#!/usr/bin/env bash
# Debian packages that dembark builds and runs with. As root missing ones are installed, else the line to run is printed.
#
#   packaging/system.sh          install what is missing
#   packaging/system.sh --list   print what is missing, one a line
#
# With DEMBARK_NO_SYSTEM=1 nothing is looked for: on machines where modules or a group's own builds take the packages' place.
set -euo pipefail
[ -z "${DEMBARK_NO_SYSTEM:-}" ] || exit 0

packages=(
  # compilers and build tools
  g++ cmake ninja-build make git catch2 pkg-config libeigen3-dev
  # LIGGGHTS: the stock engine, its headers, MPI
  liggghts libliggghts-dev openmpi-bin libopenmpi-dev
  # Python: the project's virtual environment is made with the system's
  python3 python3-dev python3-venv
  # Siconos: the peer of the LCP solver in tests and benchmarks
  python3-siconos python3-scipy
  # a private Slurm, in which the tests of campaigns on a cluster run
  slurm-wlm munge
  # the report: text layout for the PDF, off-screen rendering for the pictures
  libpango-1.0-0 libpangoft2-1.0-0 libharfbuzz-subset0 fonts-dejavu-core
  libegl1 libgl1 libosmesa6 libxrender1 libxcursor1 libxft2 libxinerama1
)
# YADE: what its build and its Python need; a group's own YADE brings its own.
if [ -z "${YADE_PREFIX:-}" ]; then
  packages+=(
    libboost-all-dev libgts-dev libloki-dev libbz2-dev zlib1g-dev libxi-dev freeglut3-dev libxmu-dev bzip2 libsqlite3-dev
    python3-numpy python3-matplotlib python3-ipython python3-pygraphviz python3-tk python3-mpmath python3-pil python3-xlib
    python3-future python3-sphinx
  )
fi

if ! command -v dpkg-query >/dev/null; then
  [ "${1:-}" = --list ] && exit 0
  echo "dembark: this is no Debian system; install the equivalents of: ${packages[*]}" >&2
  exit 0
fi

missing=()
for package in "${packages[@]}"; do
  case $(dpkg-query -W -f '${Status}' "$package" 2>/dev/null || true) in
    *"ok installed") ;;
    *) missing+=("$package") ;;
  esac
done
if [ "${1:-}" = --list ]; then
  [ ${#missing[@]} -eq 0 ] || printf '%s\n' "${missing[@]}"
  exit 0
fi
[ ${#missing[@]} -eq 0 ] && exit 0

if [ "$(id -u)" != 0 ]; then
  echo "dembark: system packages are missing; run this line, then make again:" >&2
  echo "  sudo apt-get install --no-install-recommends ${missing[*]}" >&2
  exit 1
fi
echo "dembark: installing ${#missing[@]} system packages" >&2
log=$(mktemp)
if ! { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}"; } >"$log" 2>&1; then
  tail -5 "$log" >&2
  echo "dembark: apt-get could not install the system packages; see $log" >&2
  exit 1
fi
rm -f "$log"
