// The cloud and the cameras in WebGL, and how they are looked at.

import {
    BufferAttribute,
    BufferGeometry,
    ColorManagement,
    LineBasicMaterial,
    LineSegments,
    LinearSRGBColorSpace,
    PerspectiveCamera,
    Points,
    Scene,
    ShaderMaterial,
    Vector3,
    WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { views } from "./data.js";
import * as points from "./points.js";
import { add, dot, length, mean, normalize, scale, subtract } from "./vectors.js";

// Colors are those of photographs and legends, not of lights.
ColorManagement.enabled = false;

const VERTEX = `
attribute vec3 tint;
varying vec3 shade;
uniform float size;
uniform float least;
void main() {
  shade = tint;
  vec4 place = modelViewMatrix * vec4(position, 1.0);
  gl_Position = projectionMatrix * place;
  gl_PointSize = clamp(size * projectionMatrix[1][1] / max(-place.z, 1e-6), least, 64.0);
}`;
const FRAGMENT = `
varying vec3 shade;
void main() {
  vec2 place = gl_PointCoord - 0.5;
  if (dot(place, place) > 0.27) discard;
  gl_FragColor = vec4(shade, 1.0);
}`;

const FRUSTUM = [0xf2, 0xad, 0x5c];
const CHOSEN = [0xff, 0xff, 0xff];
// Radians and fractions for a press of a key.
const TURN = 0.09;
const MOVE = 0.06;
const ZOOM = 1.15;

export class Scene3d {
    // Throws where there is no WebGL.
    constructor(canvas) {
        this.canvas = canvas;
        this.renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
        this.renderer.outputColorSpace = LinearSRGBColorSpace;
        this.renderer.setClearColor(getComputedStyle(canvas.parentElement).backgroundColor, 1);
        this.scene = new Scene();
        this.measure();
        this.camera = new PerspectiveCamera(50, 1, this.radius / 500, this.radius * 200);
        this.camera.up.set(...points.facts.up);
        this.controls = new OrbitControls(this.camera, canvas);
        this.controls.enableDamping = true;
        this.controls.dampingFactor = 0.12;
        this.controls.autoRotateSpeed = 0.8;
        // The wheel scrolls the page until the cloud is in use.
        this.controls.enableZoom = false;
        canvas.addEventListener("focus", () => (this.controls.enableZoom = true));
        canvas.addEventListener("blur", () => (this.controls.enableZoom = false));
        canvas.addEventListener("pointerdown", () => canvas.focus({ preventScroll: true }));
        canvas.addEventListener("touchstart", () => (this.controls.enableZoom = true), { passive: true });
        this.controls.addEventListener("change", () => this.draw());
        this.addPoints();
        this.addCameras();
        new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
        this.resize();
        this.reset();
    }

    // Center and radius of what is to be seen, without outliers.
    measure() {
        const axes = [0, 1, 2].map((axis) =>
            points.quantiles((point) => points.local[3 * point + axis], [0.04, 0.5, 0.96]),
        );
        const cameras = views.map(({ center }) => subtract(center, points.middle));
        this.cameras = cameras;
        this.center = points.total ? axes.map(([, median]) => median) : mean(cameras);
        const size = length(axes.map(([low, , high]) => high - low)) / 2;
        const far = Math.max(...cameras.map((place) => length(subtract(place, this.center))));
        this.radius = (points.total ? size : far) || 1;
        this.extent = Math.max(this.radius, Math.min(far, 20 * this.radius));
    }

    addPoints() {
        this.geometry = new BufferGeometry();
        this.geometry.setAttribute("position", new BufferAttribute(points.local, 3));
        const material = new ShaderMaterial({
            vertexShader: VERTEX,
            fragmentShader: FRAGMENT,
            uniforms: { size: { value: 1 }, least: { value: 1 } },
        });
        this.points = new Points(this.geometry, material);
        this.points.frustumCulled = false;
        this.scene.add(this.points);
        // About the distance of neighbors on a surface.
        this.spacing = (3.7 * this.radius) / Math.sqrt(Math.max(points.total, 1));
        this.factor = 1;
    }

    addCameras() {
        const distances = this.cameras.map((place, view) =>
            Math.min(
                ...this.cameras.map((other, index) =>
                    index === view ? Infinity : length(subtract(place, other)) || Infinity,
                ),
            ),
        );
        const typical =
            distances.filter(Number.isFinite).sort((a, b) => a - b)[Math.floor(distances.length / 2)] ??
            this.radius;
        const depth = Math.min(Math.max(0.6 * typical, 0.02 * this.extent), 0.16 * this.extent);
        const corners = views.map((view, index) =>
            [0, 1, 2, 3].map((corner) => {
                const [fx, fy, cx, cy] = view.lens;
                const x = ((corner === 1 || corner === 2 ? view.size[0] : 0) - cx) / fx;
                const y = ((corner > 1 ? view.size[1] : 0) - cy) / fy;
                const ray = [0, 1, 2].map(
                    (axis) => x * view.axes[0][axis] + y * view.axes[1][axis] + view.axes[2][axis],
                );
                return add(this.cameras[index], scale(ray, depth));
            }),
        );
        const lines = corners.flatMap((four, index) =>
            four.flatMap((corner, place) => [this.cameras[index], corner, corner, four[(place + 1) % 4]]),
        );
        const geometry = new BufferGeometry();
        geometry.setAttribute("position", new BufferAttribute(new Float32Array(lines.flat()), 3));
        this.tints = new BufferAttribute(new Uint8Array(3 * lines.length), 3, true);
        geometry.setAttribute("color", this.tints);
        this.frusta = new LineSegments(
            geometry,
            new LineBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.85 }),
        );
        this.frusta.frustumCulled = false;
        this.scene.add(this.frusta);
        this.choose(null);
    }

    // Marks a camera.
    choose(view) {
        for (let index = 0; index < this.tints.count; index++) {
            this.tints.array.set(Math.floor(index / 16) === view ? CHOSEN : FRUSTUM, 3 * index);
        }
        this.tints.needsUpdate = true;
        this.draw();
    }

    setColors(bytes) {
        this.geometry.setAttribute("tint", new BufferAttribute(bytes, 3, true));
        this.draw();
    }

    setPointSize(factor) {
        this.factor = factor;
        this.resize();
    }

    setCameras(isShown) {
        this.frusta.visible = isShown;
        this.draw();
    }

    resize() {
        const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
        if (!width || !height) return;
        this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
        this.renderer.setSize(width, height, false);
        this.camera.aspect = width / height;
        this.camera.updateProjectionMatrix();
        const ratio = this.renderer.getPixelRatio();
        const { uniforms } = this.points.material;
        uniforms.size.value = (this.factor * this.spacing * height * ratio) / 2;
        uniforms.least.value = Math.max(1, this.factor * ratio);
        this.draw();
    }

    // Looks at the middle of the cloud from above the middle of the cameras.
    reset() {
        const { up } = points.facts;
        const from = subtract(mean(this.cameras), this.center);
        let direction =
            length(from) > 0.15 * this.radius
                ? normalize(from)
                : normalize(
                      add(
                          views[0].axes[2].map((value) => -value),
                          scale(up, 0.6),
                      ),
                  );
        const rise = dot(direction, up);
        if (rise > 0.95) direction = normalize(add(direction, scale(views[0].axes[1], 0.5)));
        else if (rise < 0.25) direction = normalize(add(direction, scale(up, 0.3 - rise)));
        const fit = (this.radius / Math.sin((25 * Math.PI) / 180) / Math.min(1, this.camera.aspect)) * 0.95;
        this.look(add(this.center, scale(direction, fit)), this.center);
    }

    look(from, at) {
        this.camera.position.set(...from);
        this.controls.target.set(...at);
        this.controls.update();
        this.draw();
    }

    lookThrough(view) {
        const { axes, depth } = views[view];
        const middle = depth ? Math.sqrt(depth[0] * depth[1]) : this.radius;
        this.look(this.cameras[view], add(this.cameras[view], scale(axes[2], middle)));
        this.choose(view);
    }

    // Keys: arrows turn, with Shift they move; + and - zoom; Home resets. Whether the key was one of them.
    press({ key, shiftKey }) {
        const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
        const offset = this.camera.position.clone().sub(this.controls.target);
        const { up } = this.camera;
        const right = new Vector3().crossVectors(up, offset).normalize();
        if (arrows[key] && shiftKey) {
            const [x, y] = arrows[key];
            const above = new Vector3().crossVectors(offset, right).normalize();
            const move = right
                .multiplyScalar(x)
                .addScaledVector(above, y)
                .multiplyScalar(MOVE * offset.length());
            this.camera.position.add(move);
            this.controls.target.add(move);
        } else if (arrows[key]) {
            const [x, y] = arrows[key];
            const polar = offset.angleTo(up);
            const turned = Math.min(Math.max(polar - y * TURN, 0.02), Math.PI - 0.02) - polar;
            offset.applyAxisAngle(right, turned).applyAxisAngle(up, x * TURN);
            this.camera.position.copy(this.controls.target).add(offset);
        } else if (key === "+" || key === "=" || key === "-" || key === "_") {
            offset.multiplyScalar(key === "+" || key === "=" ? 1 / ZOOM : ZOOM);
            this.camera.position.copy(this.controls.target).add(offset);
        } else if (key === "Home") this.reset();
        else return false;
        this.controls.update();
        this.draw();
        return true;
    }

    // The nearest point to the eye within a few pixels of a place in the canvas, and the camera there.
    pick(x, y) {
        const { clientWidth: width, clientHeight: height } = this.canvas;
        const matrix = this.camera.projectionMatrix.clone().multiply(this.camera.matrixWorldInverse).elements;
        const project = ([a, b, c]) => {
            const w = matrix[3] * a + matrix[7] * b + matrix[11] * c + matrix[15];
            if (w <= 0) return null;
            const across = (matrix[0] * a + matrix[4] * b + matrix[8] * c + matrix[12]) / w;
            const down = (matrix[1] * a + matrix[5] * b + matrix[9] * c + matrix[13]) / w;
            return [((across + 1) / 2) * width, ((1 - down) / 2) * height, w];
        };
        let [point, nearest] = [-1, Infinity];
        for (let index = 0; index < points.total; index++) {
            const start = 3 * index;
            const place = project([points.local[start], points.local[start + 1], points.local[start + 2]]);
            if (!place) continue;
            const distance = Math.max(Math.abs(place[0] - x), Math.abs(place[1] - y));
            if (distance < 5 && place[2] < nearest) [point, nearest] = [index, place[2]];
        }
        let [view, closest] = [-1, 10];
        if (this.frusta.visible) {
            this.cameras.forEach((camera, index) => {
                const place = project(camera);
                const distance = place ? Math.hypot(place[0] - x, place[1] - y) : Infinity;
                if (distance < closest) [view, closest] = [index, distance];
            });
        }
        return { point, view };
    }

    // Draws in the next frame; goes on while the cloud turns or glides.
    draw() {
        if (this.waiting) return;
        this.waiting = true;
        requestAnimationFrame(() => {
            this.waiting = false;
            this.renderer.render(this.scene, this.camera);
            if (this.isVisible !== false && !document.hidden) this.controls.update();
            if (this.controls.autoRotate && this.isVisible !== false) this.draw();
        });
    }
}
