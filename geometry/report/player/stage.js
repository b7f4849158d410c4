// SPDX-License-Identifier: MIT
// What the actors stand on and are lit by. Draws only when something changed.
import {
  Color,
  DirectionalLight,
  HemisphereLight,
  Mesh,
  NeutralToneMapping,
  PCFShadowMap,
  PerspectiveCamera,
  PlaneGeometry,
  Scene,
  ShaderMaterial,
  ShadowMaterial,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const kGroundSize = 60;

// Lines every half meter, stronger every meter, fading with distance from `center`.
const kGridVertex = `
  varying vec2 place;
  void main() {
    place = position.xy;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  }`;
const kGridFragment = `
  varying vec2 place;
  uniform vec3 color;
  uniform vec2 center;
  float lines(float spacing) {
    vec2 at = place / spacing;
    vec2 away = abs(fract(at - 0.5) - 0.5) / fwidth(at);
    return 1.0 - min(min(away.x, away.y), 1.0);
  }
  void main() {
    float fade = exp(-0.11 * dot(place - center, place - center));
    float strength = max(0.22 * lines(0.5), 0.5 * lines(1.0));
    gl_FragColor = vec4(color, strength * fade);
  }`;

export class Stage {
  constructor(canvas, { ground = true, up = [0, 0, 1] } = {}) {
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.renderer.toneMapping = NeutralToneMapping;
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(30, 1, 0.02, 120);
    this.camera.up.fromArray(up);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.12;
    this.controls.minDistance = 0.12;
    this.controls.maxDistance = 30;
    this.controls.maxPolarAngle = 0.55 * Math.PI;
    this.controls.addEventListener("change", () => this.invalidate());
    this.addLights();
    if (ground) this.addGround();
    this.stale = true;
    this.before = null; // called before each picture
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
    const tick = (now) => {
      requestAnimationFrame(tick);
      if (this.before?.(now)) this.stale = true;
      this.controls.update();
      if (this.stale) {
        this.stale = false;
        this.renderer.render(this.scene, this.camera);
      }
    };
    requestAnimationFrame(tick);
  }

  invalidate() {
    this.stale = true;
  }

  addLights() {
    this.sky = new HemisphereLight("#ffffff", "#a39c95", 2.0);
    this.sky.position.set(0, 0, 1);
    this.key = new DirectionalLight("#fffaf2", 2.9);
    this.key.castShadow = true;
    this.key.shadow.mapSize.set(2048, 2048);
    this.key.shadow.radius = 3;
    this.key.shadow.bias = -0.0002;
    this.key.shadow.normalBias = 0.012;
    const box = this.key.shadow.camera;
    [box.left, box.right, box.bottom, box.top, box.near, box.far] = [-1.5, 1.5, -1.5, 1.5, 0.5, 9];
    this.rim = new DirectionalLight("#cfe0ff", 1.1);
    this.scene.add(this.sky, this.key, this.key.target, this.rim, this.rim.target);
  }

  addGround() {
    const plane = new PlaneGeometry(kGroundSize, kGroundSize);
    this.grid = new Mesh(
      plane,
      new ShaderMaterial({
        vertexShader: kGridVertex,
        fragmentShader: kGridFragment,
        uniforms: { color: { value: new Color() }, center: { value: new Vector3() } },
        transparent: true,
        depthWrite: false,
      }),
    );
    this.grid.renderOrder = -2;
    this.shade = new Mesh(plane, new ShadowMaterial({ opacity: 0.22 }));
    this.shade.material.depthWrite = false;
    this.shade.receiveShadow = true;
    this.shade.renderOrder = -1;
    this.scene.add(this.grid, this.shade);
  }

  // Light from the front left of a body that faces `heading`, a rim from behind.
  light(heading, center) {
    const [hx, hy] = heading;
    const place = (light, forward, left, up) => {
      light.position.set(
        center[0] + forward * hx - left * hy,
        center[1] + forward * hy + left * hx,
        up,
      );
      light.target.position.set(center[0], center[1], 0.8);
    };
    place(this.key, 2.9, 1.5, 3.9);
    place(this.rim, -2.5, -1.8, 2.6);
    this.grid.material.uniforms.center.value.set(center[0], center[1], 0);
  }

  setTheme(dark) {
    this.grid.material.uniforms.color.value.set(dark ? "#8fa0b8" : "#66748a");
    this.shade.material.opacity = dark ? 0.45 : 0.2;
    this.sky.intensity = dark ? 1.5 : 2.0;
    this.invalidate();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (width === 0 || height === 0) return;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.renderer.render(this.scene, this.camera); // at once: a resized canvas is blank
  }
}
