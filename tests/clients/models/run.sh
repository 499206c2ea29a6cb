#!/usr/bin/env bash
# A tree that Blender made, in a forest: run.sh NEMORAL PYTHON FOLDER
# PYTHON has numpy, and bpy, which is for one release of Python alone.
set -euo pipefail
nemoral=$1 python=$2 folder=$3
here=$(cd "$(dirname "$0")" && pwd)
if ! "$python" -c "import bpy" 2> /dev/null; then
    echo "SKIPPED: Blender (bpy is for one release of Python alone, which this is not)"
    exit 0
fi
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
"$python" "$here/make_tree.py" "$folder" | grep '^Blender'
for file in glb gltf obj; do
    "$nemoral" generate --preset low --out "$folder/$file" --quiet --set frames=2 \
        --set camera.width_px=320 --set camera.height_px=180 --set placement.shrubs=0 \
        --set placement.regeneration.saplings=0 --set assets.individuals=1 \
        --set "models.blender_tree.file=$folder/tree.$file" --set models.blender_tree.share=1
    "$nemoral" check "$folder/$file" > /dev/null
done
"$python" "$here/check.py" "$folder"
