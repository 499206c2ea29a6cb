#!/usr/bin/env bash
# Lets a foreign program read what a data set becomes in every format, and its own files:
#   run.sh NEMORAL PYTHON DATASET FOLDER [CLIENT...]
# CLIENT is such as `coco`, for read_coco.py; if none is given, all but `euroc`, `kitti2015` and
# `nuscenes`, which have no place for the lenses of data-set.toml.
# A client's first line names the format that it reads (`--to FORMAT`); one that names none reads
# the data set itself.
set -euo pipefail
nemoral=$1 python=$2 dataset=$3 folder=$4
here=$(dirname "$0")
shift 4
if [ $# = 0 ]; then
    clients=$(cd "$here" && ls read_*.py | sed -E 's/read_(.*)\.py/\1/' \
        | grep -vxE 'euroc|kitti2015|nuscenes')
    # shellcheck disable=SC2086
    set -- $clients
fi
for name in "$@"; do
    client="$here/read_$name.py"
    format=$(sed -nE '1s/.*--to ([a-z0-9]+).*/\1/p' "$client")
    arguments=("$dataset")
    if [ -n "$format" ]; then
        "$nemoral" convert "$dataset" --to "$format" --out "$folder/$name" --quiet
        arguments+=("$folder/$name")
    fi
    "$python" "$client" "${arguments[@]}" 2> "$folder/$name.log" | tail -n 1 \
        || { tail -n 20 "$folder/$name.log"; exit 1; }
done
