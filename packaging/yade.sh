#!/usr/bin/env bash
# Find a YADE, or get YADE 2025.2.0 once into a cache outside the checkout.
#
#   packaging/yade.sh             print the prefix and the source folder that will be used, fetching and building what is needed
#   packaging/yade.sh --where     the same without fetching or building; fails when there is none
#   packaging/yade.sh --packaged  exit code 0 when YADE 2025.2.0 is a package of this system, to be used with its headers
#
# In this order: a group's own YADE, named by YADE_PREFIX (what `cmake --install` filled) and YADE_SOURCE_DIR (the matching source tree,
# for its headers); the package of the distribution (Debian 13), with headers from its source package; a build of the same source with
# Python (Debian 12, and other systems). The source is YADE_ARCHIVE, an archive of it; otherwise it comes through apt from Debian's trixie
# suite, with lists and state of its own so that the machine's apt stays as it was.
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
version=2025.2.0
sha256=42702372251bf5e8f07a364bdf30533a1318947e4db90435b1f89293dc029156
python=${SYSTEM_PYTHON:-/usr/bin/python3}
# Whatever is changed here, in targets.cmake or in engine_classes.cmake makes a new build.
flags=(-DDISABLE_ALL=ON -DENABLE_OPENMP=ON -DENABLE_LOGGER=ON -DENABLE_USEFUL_ERRORS=OFF -DENABLE_MULTI_REAL_HP=OFF
       -DNOSUFFIX=ON -DDISABLE_SAVE_TEMPS=ON
       -DDISABLE_PKGS=fem,lbm,levelSet,openfoam,pfv,polyhedra,potential,image,vtk
       -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=12 "-DCMAKE_CXX_FLAGS_RELEASE=-O2 -DNDEBUG")

# Features that this build leaves out, by the names of YADE's own options: YADE_FEATURES="VTK QT5" for ENABLE_VTK and ENABLE_QT5.
for feature in ${YADE_FEATURES:-}; do
  flags+=("-DENABLE_$feature=ON")
  [ "$feature" != VTK ] || flags=("${flags[@]/,vtk/}")
done

die() { printf 'dembark: %s\n' "$*" >&2; exit 1; }
answer() { printf 'YADE_PREFIX=%s\nYADE_SOURCE_DIR=%s\n' "$1" "$2"; exit 0; }

packaged() {
  [ -z "${YADE_PREFIX:-}" ] || return 1
  case $(dpkg-query -W -f '${Version}' libyade 2>/dev/null || true) in "$version"-*) return 0 ;; esac
  # Before it is installed: Debian 13 has it.
  [ -r /etc/os-release ] && (. /etc/os-release; [ "${ID:-}" = debian ] && [ "${VERSION_ID:-0}" = 13 ])
}
if [ "${1:-}" = --packaged ]; then packaged; exit; fi

if [ -n "${YADE_PREFIX:-}" ]; then
  [ -x "$YADE_PREFIX/bin/yade" ] || die "YADE_PREFIX=$YADE_PREFIX has no bin/yade; set it to the folder YADE was installed into"
  [ -n "${YADE_SOURCE_DIR:-}" ] || die "YADE_PREFIX is set but YADE_SOURCE_DIR is not; set it to the source tree that this YADE was built from"
  [ -e "$YADE_SOURCE_DIR/core/Scene.hpp" ] || die "YADE_SOURCE_DIR=$YADE_SOURCE_DIR has no core/Scene.hpp; set it to the top of YADE's source tree"
  answer "$YADE_PREFIX" "$YADE_SOURCE_DIR"
fi

cache=${XDG_CACHE_HOME:-$HOME/.cache}/dembark
if packaged; then
  prefix=/usr store=$cache/yade-$version-headers
  [ -x /usr/bin/yade ] || die "YADE's package is not installed; run 'make system'"
else
  pyversion=$($python -c 'import sys; print("%d.%d" % sys.version_info[:2])')
  key=$({ printf '%s\n' "$version" "$pyversion" "$(c++ -dumpfullversion 2>/dev/null || echo none)" "$(uname -m)" "${flags[@]}"
          cat "$here/yade/targets.cmake" "$here/../plugins/yade/engine_classes.cmake"; } | sha256sum | cut -c1-10)
  store=$cache/yade-$version-$key prefix=$store/prefix
fi
source=$store/source
[ -e "$store/.complete" ] && answer "$prefix" "$source"
[ "${1:-}" = --where ] && die "no YADE found; run 'make yade-engine', or set YADE_PREFIX and YADE_SOURCE_DIR"

mkdir -p "$store" || die "cannot write $store; set XDG_CACHE_HOME to a folder for the cache"
exec 9>"$store/.lock"
if ! flock -n 9; then
  echo "dembark: another build of YADE is under way in $store; waiting for it" >&2
  flock 9
  [ -e "$store/.complete" ] && answer "$prefix" "$source"
fi

unpack() {  # unpack ARCHIVE
  rm -rf "$source.part" "$source"
  mkdir -p "$source.part"
  # By Python: one package less.
  $python -c 'import sys, tarfile
with tarfile.open(sys.argv[1]) as archive:
    archive.extractall(sys.argv[2], **({"filter": "data"} if hasattr(tarfile, "data_filter") else {}))' "$1" "$source.part" ||
    die "$1 cannot be unpacked; give the archive of YADE $version"
  mv "$source.part/"*/ "$source"
  rm -rf "$source.part"
}

given() {
  [ -r "$YADE_ARCHIVE" ] || die "YADE_ARCHIVE=$YADE_ARCHIVE cannot be read; give the archive of YADE $version"
  unpack "$YADE_ARCHIVE"
  [ -e "$source/core/Scene.hpp" ] && grep -qs "$version" "$source/RELEASE" || {
    rm -rf "$source"; die "YADE_ARCHIVE=$YADE_ARCHIVE is not the source of YADE $version (its file RELEASE says otherwise)"; }
}

fetch() {
  local apt=$store/apt uri
  mkdir -p "$apt"/{lists/partial,cache/archives/partial,download}
  : >"$apt/status"
  uri=$(apt-get indextargets --format '$(CODENAME) $(COMPONENT) $(REPO_URI)' 'Created-By: Packages' 2>/dev/null |
        awk '$2 == "main" && $1 !~ /security/ && $1 !~ /updates/ { print $3; exit }')
  [ -n "$uri" ] || die "apt lists no Debian mirror from which the source of YADE could come; run 'apt-get update' on Debian, or set YADE_ARCHIVE, or YADE_PREFIX and YADE_SOURCE_DIR"
  echo "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $uri trixie main" >"$apt/trixie.list"
  local opts=(-o "Dir::Etc::sourcelist=$apt/trixie.list" -o Dir::Etc::sourceparts=/dev/null -o "Dir::State=$apt"
              -o "Dir::State::lists=$apt/lists" -o "Dir::State::status=$apt/status" -o "Dir::Cache=$apt/cache" -o APT::Sandbox::User=)
  apt-get "${opts[@]}" -qq update >"$store/fetch.log" 2>&1 || die "apt could not read the trixie source list: $(grep -m1 '^E: ' "$store/fetch.log" || tail -1 "$store/fetch.log")"
  # The .dsc may be missing on a mirror; only the upstream tarball is needed and its checksum is known.
  (cd "$apt/download" && apt-get "${opts[@]}" source --download-only "yade=$version-1" >>"$store/fetch.log" 2>&1) || true
  local tarball=$apt/download/yade_$version.orig.tar.bz2
  [ -s "$tarball" ] || die "the source of YADE $version could not be fetched: $(grep -m1 '^E: ' "$store/fetch.log" || tail -1 "$store/fetch.log")"
  echo "$sha256  $tarball" | sha256sum --check --quiet || die "the source of YADE $version has a wrong checksum: $tarball; delete it and try again"
  unpack "$tarball"
  rm -rf "$apt"
}

build() {
  echo "dembark: building YADE $version, once, into $store" >&2
  [ "$python" != /usr/bin/python3 ] || export PATH=/usr/bin:$PATH
  "$here/build.py" --name YADE --log "$store/build.log" --resume "make yade-engine" -- \
    cmake -G Ninja -S "$source" -B "$store/build" "${flags[@]}" -DPYTHON_VERSION="$pyversion" -DCMAKE_INSTALL_PREFIX="$prefix" \
          -DCMAKE_PROJECT_Yade_INCLUDE="$here/yade/targets.cmake" -DDEMBARK_PLUGIN_DIR="$here/../plugins/yade" \
          -DCMAKE_BUILD_TYPE=Release -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -- ninja -C "$store/build" -j "${JOBS:-0}" install
  [ -x "$prefix/bin/yade" ] || die "YADE did not install bin/yade into $prefix; see $store/build.log"
  cp "$store/build/compile_commands.json" "$store/"
  # What it included, for packaging/headers.py.
  ninja -C "$store/build" -t deps | sed -n 's|^ *\(/usr/.*\)|\1|p' | sort -u >"$store/headers.txt"
  rm -rf "$store/build"
}

[ -e "$source/core/Scene.hpp" ] || if [ -n "${YADE_ARCHIVE:-}" ]; then given; else fetch; fi
packaged || build
touch "$store/.complete"
answer "$prefix" "$source"
