// npm install three@0.187 esbuild@0.28
// npx esbuild three.entry.js --bundle --minify --format=iife --global-name=THREE \
//     --legal-comments=inline --outfile=three.js
export {
  BufferAttribute, BufferGeometry, Color, PerspectiveCamera, Points, Scene, ShaderMaterial, Vector3,
  WebGLRenderer,
} from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
