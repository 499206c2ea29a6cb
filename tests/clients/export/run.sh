#!/usr/bin/env bash
# Foreign programs read what `nemoral export` writes, and compare it with the truth:
#   run.sh PYTHON FOLDER
# FOLDER has what the example export_truth wrote, and node_modules with gltf-validator beside it or
# above. PYTHON has requirements.txt of this folder; if it has bpy, Blender reads the scene too.
set -euo pipefail
python=$1 folder=$(cd "$2" && pwd)
here=$(cd "$(dirname "$0")" && pwd)
(cd "$folder" && node "$here/validate.mjs" "$folder/instanced.glb" "$folder/nodes.glb" "$folder"/sdf/meshes/*.glb)
for client in read_trimesh read_usd read_sdf read_height_map; do
    "$python" "$here/$client.py" "$folder"
done
if "$python" -c "import bpy" 2> /dev/null; then
    "$python" "$here/read_blender.py" "$folder" 2>&1 | grep -E '^Blender|Error'
else
    echo "SKIPPED: Blender (bpy is for one release of Python alone, which this is not)"
fi
