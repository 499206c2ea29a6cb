#!/usr/bin/env bash
# A tree that Blender made, in a forest: run.sh NEMORAL PYTHON FOLDER
# PYTHON has bpy, numpy and pillow.
set -euo pipefail
nemoral=$1 python=$2 folder=$3
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$folder"
"$python" "$here/make_tree.py" "$folder" | grep '^Blender'
for file in glb gltf obj; do
    "$nemoral" generate --preset low --out "$folder/$file" --quiet --set frames=2 \
        --set camera.width_px=320 --set camera.height_px=180 --set placement.shrubs=0 \
        --set placement.regeneration.saplings=0 --set assets.individuals=1 \
        --set "models.blender_tree.file=$folder/tree.$file" --set models.blender_tree.share=1
    "$nemoral" check "$folder/$file" > /dev/null
done
"$python" "$here/check.py" "$folder"
