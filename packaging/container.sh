#!/usr/bin/env bash
# Build a container image of dembark with all engines, from packages of Debian 13 and the Python packages of requirements.lock.
#
#   packaging/container.sh [-o FOLDER] [-- OPTIONS OF MMDEBSTRAP]
#
# FOLDER, build/container unless it is given, then has dembark-VERSION.oci.tar, an OCI image for Apptainer and Podman,
# dembark-VERSION.tar, the same as a root file system for Charliecloud, and packages.txt, the packages of Debian in it. The sources are those
# of the last commit. It needs Debian's packages mmdebstrap and umoci, and either root or user namespaces. A network with a proxy of its own
# may need options of mmdebstrap, such as --aptopt=FILE, and --customize-hook='upload FILE /usr/local/share/ca-certificates/own.crt'.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
top=$(dirname "$here")
folder=$top/build/container
die() { printf 'dembark: %s\n' "$*" >&2; exit 1; }
if [ "${1:-}" = -o ]; then folder=${2:?the folder after -o}; shift 2; fi
if [ "${1:-}" = -- ]; then shift; fi

for program in mmdebstrap umoci; do
  command -v $program > /dev/null || die "no $program; install Debian's packages mmdebstrap and umoci"
done
version=$(git -C "$top" show HEAD:pyproject.toml | sed -nE 's/^version = "(.*)"$/\1/p') || die "$top is no checkout; build the image from one"
mkdir -p "$folder" || die "cannot write $folder; choose another folder with -o"
folder=$(cd "$folder" && pwd)
case $folder in *[[:space:]]*) die "$folder has a space; choose another folder with -o" ;; esac
work=$(mktemp -d "$folder/.work.XXXXXX")
trap 'rm -rf --one-file-system "$work"' EXIT
git -C "$top" archive --output "$work/source.tar" HEAD

# What the Python packages and YADE load without being linked to it.
loaded="python3 yade openmpi-bin fonts-dejavu-core libpango-1.0-0 libpangoft2-1.0-0 libharfbuzz-subset0 libegl1 libgl1 libosmesa6"
cat > "$work/build.sh" <<'EOF'
set -eu
cd /opt/dembark
# LAMMPS, too, is Debian's: its MPI is that of LIGGGHTS.
DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends lammps liblammps-dev
update-ca-certificates
export XDG_CACHE_HOME=/opt/cache LAMMPS_INSTALLED=ON PIP_NO_CACHE_DIR=1
make all
# The engines are built; what is left serves to run.
.venv/bin/pip uninstall -q -y clang-format clang-tidy mypy mypy-extensions ruff
rm -rf /opt/cache build/python build/*.log
find build -name '*.o' -delete
find . -name tests -type d -not -path './.venv/*' -prune -exec rm -rf {} +
.venv/bin/python -m compileall -q common input_decks plugins postproc validation
find .venv build -type f \( -name '*.so*' -o -perm -u+x \) -exec ldd {} + 2> /dev/null | sed -nE 's/^.* => (\/[^ ]+) .*/\1/p' | sort -u |
  grep -v '^/opt/' | xargs realpath | xargs dpkg -S 2> /dev/null | sed 's/:.*//' | sort -u > /opt/linked
[ -s /opt/linked ]
EOF

places='PATH=/opt/dembark/.venv/bin:/opt/dembark/build/bin:/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin'
# Each engine must run in the image.
cat > "$work/try.sh" <<EOF
set -eu
export $places
dpkg-query -W > /packages.txt
for engine in liggghts yade lammps; do dembark run bead_chain --engine \$engine --out /tmp/\$engine; done
rm -rf /tmp/* /root/.cache
EOF

step() { echo "dembark: container: $* ($((SECONDS / 60)) min)" >&2; }
run() { mmdebstrap --quiet --variant=minbase --dpkgopt='path-exclude=/usr/share/doc/*' --dpkgopt='path-include=/usr/share/doc/*/copyright' \
        --dpkgopt='path-exclude=/usr/share/man/*' "$@"; }
step "building dembark in a Debian 13"
run --include=ca-certificates,git,make "$@" --customize-hook='mkdir -p "$1/opt/dembark"' \
  --customize-hook="tar-in $work/source.tar /opt/dembark" --customize-hook="upload $work/build.sh /opt/build.sh" \
  --customize-hook='chroot "$1" sh /opt/build.sh >&2' --customize-hook="download /opt/linked $work/linked" \
  --customize-hook="tar-out /opt/dembark $work/dembark.tar" trixie /dev/null

step "adding it to the packages that it runs with"
printf '%s\n' "$places" LANG=C.UTF-8 > "$work/environment"
include=$(printf '%s\n' $loaded $(cat "$work/linked") | sort -u | paste -sd,)
run --include="$include" "$@" --customize-hook='mkdir -p "$1/opt" "$1/ch"' --customize-hook="tar-in $work/dembark.tar /opt" \
  --customize-hook="upload $work/environment /ch/environment" \
  --customize-hook='rm -rf "$1"/var/lib/apt/lists/* "$1"/var/cache/*' \
  --customize-hook="upload $work/try.sh /try.sh" --customize-hook='chroot "$1" sh /try.sh >&2' \
  --customize-hook="download /packages.txt $work/packages.txt" --customize-hook='rm "$1/try.sh" "$1/packages.txt"' trixie "$work/root.tar"

step "writing the image"
umoci init --layout "$work/oci"
umoci new --image "$work/oci:$version"
umoci raw add-layer --image "$work/oci:$version" "$work/root.tar"
umoci config --image "$work/oci:$version" --config.env "$places" --config.env LANG=C.UTF-8 --config.cmd bash \
  --config.label org.opencontainers.image.title=dembark --config.label "org.opencontainers.image.version=$version" \
  --config.label org.opencontainers.image.licenses=GPL-2.0-or-later
tar -C "$work/oci" -cf "$work/oci.tar" .
mv "$work/packages.txt" "$folder/packages.txt"
mv "$work/root.tar" "$folder/dembark-$version.tar"
mv "$work/oci.tar" "$folder/dembark-$version.oci.tar"
step "done: $folder/dembark-$version.oci.tar, $(du -m "$folder/dembark-$version.oci.tar" | cut -f1) MB"
