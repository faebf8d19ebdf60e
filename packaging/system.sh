#!/usr/bin/env bash
# Debian packages that dembark builds and runs with. As root missing ones are installed, else the line to run is printed.
#
#   packaging/system.sh          install what is missing
#   packaging/system.sh --list   print what is missing, one a line
#   packaging/system.sh --all    print all that are needed here, one a line
#
# With DEMBARK_NO_SYSTEM=1 nothing is looked for: on machines where modules or a group's own builds take the packages' place.
set -euo pipefail
[ -z "${DEMBARK_NO_SYSTEM:-}" ] || exit 0
here=$(cd "$(dirname "$0")" && pwd)

packages=(
  # compilers and build tools
  g++ cmake ninja-build make git catch2 pkg-config libeigen3-dev
  # LIGGGHTS: the stock engine, its headers, MPI
  liggghts libliggghts-dev openmpi-bin libopenmpi-dev
  # Python: the project's virtual environment is made with the system's
  python3 python3-dev python3-venv
  # a private Slurm, in which the tests of campaigns on a cluster run
  slurm-wlm munge
  # the report: text layout for the PDF, off-screen rendering for the pictures
  libpango-1.0-0 libpangoft2-1.0-0 libharfbuzz-subset0 fonts-dejavu-core
  libegl1 libgl1 libosmesa6 libxrender1 libxcursor1 libxft2 libxinerama1
)
# Siconos, the peer of the LCP solver in benchmarks, is no package of Debian 13: comparisons with it are then left out.
if [ "$(. /etc/os-release 2>/dev/null; echo "${ID:-}${VERSION_ID:-}")" != debian13 ]; then packages+=(python3-siconos python3-scipy); fi
# YADE; a group's own brings what it needs.
if "$here/yade.sh" --packaged; then
  # The plugin needs the package, and what its headers include.
  packages+=(yade libboost-dev libmpfr-dev libmpfrc++-dev libmpc-dev python3-numpy)
elif [ -z "${YADE_PREFIX:-}" ]; then
  # What its build and its Python need.
  packages+=(
    libboost-dev libboost-python-dev libboost-thread-dev libboost-filesystem-dev libboost-iostreams-dev libboost-regex-dev
    libboost-serialization-dev libboost-system-dev libboost-date-time-dev libboost-log-dev libbz2-dev zlib1g-dev libsqlite3-dev bzip2
    python3-numpy python3-matplotlib python3-ipython python3-pygraphviz python3-tk python3-mpmath python3-pil python3-xlib python3-sphinx
  )
fi

case ${1:-} in
  --all) printf '%s\n' "${packages[@]}"; exit 0 ;;
esac
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
log=$(mktemp)
failed() {
  # apt's own sentence says what is wrong; a package of another release is the commonest.
  reason=$(grep -m1 '^E: ' "$log" || tail -1 "$log")
  echo "dembark: apt-get could not install the system packages: ${reason#E: }; see $log (supported are Debian 12 and 13)" >&2
  exit 1
}
apt-get update -qq >"$log" 2>&1 || failed
size=$(apt-get install --no-install-recommends --print-uris -y -qq "${missing[@]}" 2>/dev/null |
       awk '{ n++; bytes += $3 } END { if (n) printf ": %d with what they need, %d MB to fetch", n, bytes / 1e6 + 0.5 }' || true)
echo "dembark: installing ${#missing[@]} system packages$size" >&2
DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}" >"$log" 2>&1 &
pid=$! begun=$SECONDS shown=$SECONDS
while kill -0 "$pid" 2>/dev/null; do
  sleep 1
  if [ $((SECONDS - shown)) -ge 20 ]; then
    shown=$SECONDS
    total=$(sed -nE 's/^.* ([0-9]+) newly installed.*/\1/p' "$log" | head -1)
    ready=$(grep -c '^Setting up ' "$log" || true) unpacked=$(grep -c '^Unpacking ' "$log" || true)
    echo "dembark: system packages: $((SECONDS - begun)) s passed, $unpacked unpacked and $ready set up of ${total:-many}" >&2
  fi
done
wait "$pid" || failed
rm -f "$log"
