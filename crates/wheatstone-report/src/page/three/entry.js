// The parts of three.js that the report's view uses, under one name.
import {
    AmbientLight, BufferAttribute, BufferGeometry, Color, DirectionalLight, IcosahedronGeometry,
    InstancedMesh, LineBasicMaterial, LineSegments, Matrix4, MeshLambertMaterial, PerspectiveCamera,
    Points, Quaternion, Scene, ShaderMaterial, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

globalThis.THREE = {
    AmbientLight, BufferAttribute, BufferGeometry, Color, DirectionalLight, IcosahedronGeometry,
    InstancedMesh, LineBasicMaterial, LineSegments, Matrix4, MeshLambertMaterial, OrbitControls,
    PerspectiveCamera, Points, Quaternion, Scene, ShaderMaterial, Vector3, WebGLRenderer,
};
