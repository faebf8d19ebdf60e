#!/usr/bin/env bash
# Copy dembark's styles into a LIGGGHTS source tree, for groups that build their own engine.
#
#   packaging/install_liggghts.sh .../LIGGGHTS-PUBLIC/src
#
# The styles go into src/ as they are, the headers of the laws into src/dembark/, and the combinations of contact models into
# style_contact_model_user.whitelist, from which LIGGGHTS's own `make` generates its optimised pair loops. A second run changes
# only what differs, so that nothing is compiled again without need.
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)

die() { printf 'dembark: %s\n' "$*" >&2; exit 2; }

src=${1:-}
[ -n "$src" ] || die "no LIGGGHTS source folder given; use make install-liggghts LIGGGHTS_SRC=.../src"
[ -d "$src" ] || die "LIGGGHTS source folder $src does not exist; give the folder src of LIGGGHTS-PUBLIC 3.8.0"
for file in pair_gran_base.h tangential_model_history.h Make.sh; do
  [ -e "$src/$file" ] || die "$src is no LIGGGHTS source folder (it has no $file); give the folder src of LIGGGHTS-PUBLIC 3.8.0"
done
version=$(cat "$src/version_liggghts.txt" 2>/dev/null || true)
[ "$version" = 3.8.0 ] || die "$src is LIGGGHTS ${version:-of an unknown version}; the styles are made for LIGGGHTS-PUBLIC 3.8.0"
[ -w "$src" ] || die "$src is not writable; install as its owner"

# Two models of one kind with one number, and LIGGGHTS's Make.sh stops without naming a file.
for kind in tangential cohesion; do
  macro=$(echo "$kind" | tr '[:lower:]' '[:upper:]')_MODEL
  for ours in "$here"/plugins/liggghts/"${kind}"_model_*.h; do
    number=$(sed -nE "s/^$macro\\(.*, *([0-9]+)\\).*/\\1/p" "$ours")
    for other in "$src/${kind}"_model_*.h; do
      [ "$(basename "$other")" = "$(basename "$ours")" ] && continue
      ! grep -qE "^$macro\\(.*, *$number *\\)" "$other" ||
        die "$other has the model number $number that $(basename "$ours") needs; give it another one (0-63)"
    done
  done
done

changed=0
copy() {  # copy FILE TARGET
  cmp -s "$1" "$2" && return
  mkdir -p "$(dirname "$2")"
  cp "$1" "$2"
  changed=$((changed + 1))
}
# The models and what they include; the rest of that folder is liggghts-dembark's own way into a finished library.
for file in "$here"/plugins/liggghts/*_model_*.h "$here"/plugins/liggghts/{bridge_reach,cohesion_on_core,contact_data,model_properties}.h "$here"/plugins/liggghts/engine_access.{h,cpp}; do
  copy "$file" "$src/$(basename "$file")"
done
# What LIGGGHTS and LAMMPS both have.
family=$here/plugins/lammps_family
for file in "$here/plugins/liggghts/engine_fix.h" "$family"/{shared,liquid,energy_account,resume}_fix.{h,cpp} "$family"/{resume_record.cpp,shared_stl.h}; do
  copy "$file" "$src/$(basename "$file")"
done
# Liquid that grains and walls own.
for file in "$here"/plugins/liggghts/fix_capillary_liquid*; do
  copy "$file" "$src/$(basename "$file")"
done
# Accounts of energy, and walls whose acceleration they know.
for file in "$here"/plugins/liggghts/fix_{energy_account,wall_motion}*; do
  copy "$file" "$src/$(basename "$file")"
done
# Fluids, walls and bodies.
for file in "$here"/plugins/liggghts/{pair_sph_coupled,pair_sph_options,fix_nve_sph_coupled,fix_sph_body,fix_sph_contact,sph_films,sph_rows}*; do
  copy "$file" "$src/$(basename "$file")"
done
copy "$here/plugins/physics/sph/loops_avx2.cpp" "$src/sph_loops_avx2.cpp"
# States to resume from.
for file in "$here"/plugins/liggghts/{fix_resume_exact*,exact_fixes.h,per_instance.h}; do
  copy "$file" "$src/$(basename "$file")"
done
# The fix for impacts of logs solves its equations with Eigen, a library of headers; without it LIGGGHTS would not compile any more.
eigen=$(pkg-config --cflags eigen3 2>/dev/null || true)
[ -n "$eigen" ] || { [ -d /usr/include/eigen3/Eigen ] && eigen=-I/usr/include/eigen3; }
if [ -n "$eigen" ]; then
  for file in "$here"/plugins/liggghts/fix_lcp_*.{h,cpp} "$here"/plugins/liggghts/mesh_triangles.h "$family"/{impact_fix.h,impact_fix.cpp,first_rank.h}; do
    copy "$file" "$src/$(basename "$file")"
  done
else
  echo "dembark: Eigen 3.4 (libeigen3-dev) is not there, so fix lcp/impact is left out; install it and run this again" >&2
fi
while IFS= read -r file; do
  copy "$here/plugins/physics/$file" "$src/dembark/$file"
done < <(cd "$here/plugins/physics" && find . -name '*.hpp' -not -path './tests/*' -not -path './python/*' | sed 's|^\./||' | sort)

# The combinations that liggghts-dembark holds: a bracket stands for one model after the other.
combinations() {  # combinations LINE
  local bracket='^([^(]*\()([^(]*)\(([^)]*)\)(.*)$' model
  if [[ $1 =~ $bracket ]]; then
    local before=${BASH_REMATCH[1]}${BASH_REMATCH[2]} behind=${BASH_REMATCH[4]}
    for model in ${BASH_REMATCH[3]//,/}; do combinations "$before$model$behind"; done
  else
    echo "${1/GRAN_MODELS/GRAN_MODEL}"
  fi
}
whitelist=$src/style_contact_model_user.whitelist
while IFS= read -r line; do
  if ! grep -qxF "$line" "$whitelist" 2>/dev/null; then
    # A last line without a newline would swallow ours.
    if [ -s "$whitelist" ] && [ -n "$(tail -c 1 "$whitelist")" ]; then echo >>"$whitelist"; fi
    echo "$line" >>"$whitelist"
    changed=$((changed + 1))
  fi
done < <(while IFS= read -r line; do combinations "$line"; done < <(grep '^GRAN_MODELS' "$here/plugins/liggghts/granular_combinations_list.h"))

# As published in 2017, two lines are no C++17: a stream that converts to its base, and a pointer compared with a number.
mend() {  # mend FILE OLD NEW
  if grep -F -- "$2" "$src/$1" 2>/dev/null | grep -qv '^ *//'; then
    sed -i "/^ *\/\//! s|$(printf '%s' "$2" | sed 's/[][\.*^$|]/\\&/g')|$3|" "$src/$1"
    changed=$((changed + 1))
    echo "dembark: mended $src/$1 for C++17"
  fi
}
mend utils.h 'static_cast< std::ostringstream & >(( std::ostringstream() << std::dec << a ) ).str()' 'std::to_string(a)'
mend finish.cpp 'neighbor->lists[m]->numneigh > 0' 'neighbor->lists[m]->numneigh'

if [ "$changed" = 0 ]; then echo "dembark: $src is up to date"; else echo "dembark: installed into $src"; fi
cat <<END
Next, in that folder: build LIGGGHTS as you always do, with C++17 (g++ 9 or newer; a -std=c++11 in CCFLAGS has to become -std=c++17)${eigen:+
and $eigen in CCFLAGS}, e.g.
  make auto
and use  pair_style gran model hertz tangential finnie_rabinowicz [cohesion capillary]  or  fix ... lcp/impact  in your input, as in
liggghts-dembark. The laws are the same, but two things are in liggghts-dembark alone: the loop that computes contacts in packs, in about half
the time, and  fix integration/monitor.
END
