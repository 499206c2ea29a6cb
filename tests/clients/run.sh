#!/usr/bin/env bash
# Converts a data set to every format and lets a foreign program read each:
#   run.sh NEMORAL PYTHON DATASET FOLDER
set -euo pipefail
nemoral=$1 python=$2 dataset=$3 folder=$4
here=$(dirname "$0")
for client in "$here"/read_*.py; do
    format=$(basename "$client" .py)
    format=${format#read_}
    "$nemoral" convert "$dataset" --to "$format" --out "$folder/$format" > /dev/null
    "$python" "$client" "$dataset" "$folder/$format" 2> "$folder/$format.log" | tail -n 1 \
        || { tail -n 20 "$folder/$format.log"; exit 1; }
done
