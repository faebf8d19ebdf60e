#!/usr/bin/env bash
# Find a YADE, or build YADE 2025.2.0 once into a cache outside the checkout.
#
#   packaging/yade.sh             print the prefix and the source folder that will be used, building them if need be
#   packaging/yade.sh --where     the same without building; fails when there is none
#
# A group that has its own YADE sets YADE_PREFIX (what `cmake --install` filled) and YADE_SOURCE_DIR (the matching
# source tree, for its headers). Otherwise the upstream tarball comes through apt from Debian's trixie suite, with
# lists and state of its own so that the machine's apt stays as it was, and is built with the system's Python.
set -euo pipefail

version=2025.2.0
sha256=42702372251bf5e8f07a364bdf30533a1318947e4db90435b1f89293dc029156
python=/usr/bin/python3
# Header features that change the layout of classes are part of the cache key: whatever is added here makes a new build.
flags=(-DDISABLE_ALL=ON -DENABLE_OPENMP=ON -DENABLE_LOGGER=ON -DENABLE_USEFUL_ERRORS=OFF -DENABLE_MULTI_REAL_HP=OFF
       -DNOSUFFIX=ON -DDISABLE_SAVE_TEMPS=ON
       -DDISABLE_PKGS=fem,lbm,levelSet,openfoam,pfv,polyhedra,potential,image,vtk
       -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=12 "-DCMAKE_CXX_FLAGS_RELEASE=-O2 -DNDEBUG")

die() { printf 'dembark: %s\n' "$*" >&2; exit 1; }
answer() { printf 'YADE_PREFIX=%s\nYADE_SOURCE_DIR=%s\n' "$1" "$2"; exit 0; }

if [ -n "${YADE_PREFIX:-}" ]; then
  [ -x "$YADE_PREFIX/bin/yade" ] || die "YADE_PREFIX=$YADE_PREFIX has no bin/yade; set it to the folder YADE was installed into"
  [ -n "${YADE_SOURCE_DIR:-}" ] || die "YADE_PREFIX is set but YADE_SOURCE_DIR is not; set it to the source tree that this YADE was built from"
  [ -e "$YADE_SOURCE_DIR/core/Scene.hpp" ] || die "YADE_SOURCE_DIR=$YADE_SOURCE_DIR has no core/Scene.hpp; set it to the top of YADE's source tree"
  answer "$YADE_PREFIX" "$YADE_SOURCE_DIR"
fi

pyversion=$($python -c 'import sys; print("%d.%d" % sys.version_info[:2])')
key=$(printf '%s\n' "$version" "$pyversion" "$(c++ -dumpfullversion 2>/dev/null || echo none)" "$(uname -m)" "${flags[@]}" | sha256sum | cut -c1-10)
store=${XDG_CACHE_HOME:-$HOME/.cache}/dembark/yade-$version-$key
prefix=$store/prefix source=$store/source
[ -e "$store/.complete" ] && answer "$prefix" "$source"
[ "${1:-}" = --where ] && die "no YADE found; run 'make yade-engine', or set YADE_PREFIX and YADE_SOURCE_DIR"

mkdir -p "$store"
exec 9>"$store/.lock"
if ! flock -n 9; then
  echo "dembark: another build of YADE is under way in $store; waiting for it" >&2
  flock 9
  [ -e "$store/.complete" ] && answer "$prefix" "$source"
fi

fetch() {
  local apt=$store/apt uri
  mkdir -p "$apt"/{lists/partial,cache/archives/partial,download}
  : >"$apt/status"
  uri=$(apt-get indextargets --format '$(CODENAME) $(COMPONENT) $(REPO_URI)' 'Created-By: Packages' 2>/dev/null |
        awk '$2 == "main" && $1 !~ /security/ && $1 !~ /updates/ { print $3; exit }')
  [ -n "$uri" ] || die "apt lists no Debian mirror from which the source of YADE could come; run 'apt-get update' on Debian, or set YADE_PREFIX and YADE_SOURCE_DIR"
  echo "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $uri trixie main" >"$apt/trixie.list"
  local opts=(-o "Dir::Etc::sourcelist=$apt/trixie.list" -o Dir::Etc::sourceparts=/dev/null -o "Dir::State=$apt"
              -o "Dir::State::lists=$apt/lists" -o "Dir::State::status=$apt/status" -o "Dir::Cache=$apt/cache" -o APT::Sandbox::User=)
  apt-get "${opts[@]}" -qq update >"$store/fetch.log" 2>&1 || die "apt could not read the trixie source list; see $store/fetch.log"
  # The .dsc may be missing on a mirror; only the upstream tarball is needed and its checksum is known.
  (cd "$apt/download" && apt-get "${opts[@]}" source --download-only "yade=$version-1" >>"$store/fetch.log" 2>&1) || true
  local tarball=$apt/download/yade_$version.orig.tar.bz2
  [ -s "$tarball" ] || die "the source of YADE $version could not be fetched; see $store/fetch.log"
  echo "$sha256  $tarball" | sha256sum --check --quiet || die "the source of YADE $version has a wrong checksum: $tarball"
  rm -rf "$source.part" "$source"
  mkdir -p "$source.part"
  tar -xjf "$tarball" -C "$source.part" --strip-components=1
  mv "$source.part" "$source"
  rm -rf "$apt"
}

build() {
  local cores jobs memory log=$store/build.log
  cores=$(nproc)
  memory=$(awk '/MemAvailable/ { print int($2 / 1024 / 1024) }' /proc/meminfo)
  jobs=$((memory / 2 < cores ? memory / 2 : cores))
  [ "$jobs" -ge 1 ] || jobs=1
  # 51 steps took 10.6 minutes on 2 cores: 25 s a step and core.
  echo "dembark: building YADE $version with $jobs jobs, about $(((51 * 25 / jobs + 59) / 60)) minutes, once; log in $log" >&2
  export PATH=/usr/bin:$PATH
  cmake -G Ninja -S "$source" -B "$store/build" "${flags[@]}" -DPYTHON_VERSION="$pyversion" -DCMAKE_INSTALL_PREFIX="$prefix" \
        -DCMAKE_BUILD_TYPE=Release -DCMAKE_EXPORT_COMPILE_COMMANDS=ON >"$log" 2>&1 || die "YADE could not be configured; see $log"
  local begin
  begin=$(date +%s)
  { ninja -C "$store/build" -j "$jobs" install 2>&1 || echo "BUILD FAILED"; } | tee -a "$log" |
    while IFS= read -r line; do
      case $line in
        \[*/*\]*)
          step=${line%%]*} step=${step#[}
          passed=$(($(date +%s) - begin)) done_=${step%/*} all=${step#*/}
          left=$((done_ > 2 ? passed * (all - done_) / done_ / 60 + 1 : 0))
          now="step $step, $((passed / 60)) min passed"
          if [ "$left" -gt 0 ]; then now+=", about $left min left"; fi
          if [ -t 2 ]; then printf '\r\033[Kdembark: YADE: %s' "$now" >&2
          elif [ $((done_ % 5)) = 0 ]; then printf 'dembark: YADE: %s\n' "$now" >&2; fi;;
      esac
    done
  if [ -t 2 ]; then printf '\n' >&2; fi
  [ -x "$prefix/bin/yade" ] && ! tail -1 "$log" | grep -q 'BUILD FAILED' || die "YADE did not build; see $log"
  cp "$store/build/compile_commands.json" "$store/"
}

[ -e "$source/core/Scene.hpp" ] || fetch
build
rm -rf "$store/build"
touch "$store/.complete"
answer "$prefix" "$source"
