// The section of the cloud: its picture, what can be chosen about it, legend, and values under the cursor.

import { data, views } from "./data.js";
import { count, element, number, section } from "./dom.js";
import { keyLegend, rampLegend, ticks } from "./colors.js";
import { openView } from "./dialog.js";
import * as points from "./points.js";
import { Scene3d } from "./scene3d.js";
import { length } from "./vectors.js";

const MODES = {
    photograph: "Photograph",
    normal: "Normal",
    height: "Height",
    views: "Views",
    confidence: "Confidence",
};
const KEYS =
    "Drag to turn, with the right button or two fingers to move, wheel (after a click) or pinch to " +
    "zoom. Keys: arrows turn, Shift and arrows move, + and \u2212 zoom, Home resets.";

let scene = null;
let stage = null;

export function cloud() {
    const { cloud: facts } = data;
    const canvas = element("canvas", {
        id: "cloud-canvas",
        tabindex: "0",
        role: "application",
        "aria-label": `The cloud, ${count(points.total, "point")}, with ${count(views.length, "camera")}`,
        "aria-describedby": "cloud-keys",
    });
    stage = element("div", { class: "stage" }, canvas);
    const readout = element("p", { class: "readout", id: "cloud-value" });
    const legend = element("div", { id: "cloud-legend" });
    const counted = (one) => count(points.total, one);
    const sampled =
        facts.of > points.total ? `, drawn evenly from the ${number(facts.of)} of the fused cloud` : "";
    const lead =
        facts.source === "fused"
            ? `${counted("point")}${sampled}, and the cameras they were seen from.`
            : points.total
              ? `There is no fused cloud yet: ${counted("validated pixel")} of the views that are finished.`
              : "There are no points yet.";
    section("cloud", "Cloud", lead);
    const place = document.getElementById("cloud");
    place.append(stage);
    try {
        if (!document.createElement("canvas").getContext("webgl2")) throw new Error("no context for it");
        scene = new Scene3d(canvas);
    } catch (error) {
        scene = null;
        stage.replaceChildren(
            element(
                "p",
                { id: "no-webgl" },
                `The cloud cannot be drawn: this browser has no WebGL 2 (${error.message}). The views, ` +
                    `figures and charts below need none; the file of the cloud opens in any viewer of point ` +
                    `clouds.`,
            ),
        );
        return;
    }
    place.append(
        controls(legend),
        element(
            "div",
            { class: "under" },
            legend,
            element(
                "div",
                {},
                readout,
                element("p", { class: "quiet", id: "cloud-keys" }, KEYS),
                element("p", { class: "quiet" }, note()),
            ),
        ),
    );
    place.insertBefore(place.querySelector(".controls"), stage);
    interact(canvas, readout);
}

function controls(legend) {
    const isKnown = { views: data.cloud.has_views, confidence: data.cloud.has_confidence };
    const setMode = (mode) => {
        scene.setColors(points.colors(mode));
        legend.replaceChildren(legendOf(mode));
        stage.dataset.mode = mode;
    };
    const choices = Object.entries(MODES).map(([mode, title], index) =>
        element(
            "label",
            {},
            element("input", {
                type: "radio",
                name: "color",
                value: mode,
                checked: index === 0,
                disabled: isKnown[mode] === false,
                onchange: () => setMode(mode),
            }),
            title,
        ),
    );
    const size = element("input", { type: "range", id: "point-size", min: -2, max: 2, step: 0.1, value: 0 });
    size.addEventListener("input", () => {
        scene.setPointSize(2 ** size.value);
        size.setAttribute("aria-valuetext", `${(2 ** size.value).toFixed(1)} times`);
    });
    const cameras = element("input", {
        type: "checkbox",
        checked: true,
        id: "cameras",
        onchange: () => scene.setCameras(cameras.checked),
    });
    const turn = element("button", { type: "button", class: "button", id: "turn" }, "Turn");
    const setTurn = (isOn) => {
        scene.controls.autoRotate = isOn;
        turn.setAttribute("aria-pressed", String(isOn));
        scene.draw();
    };
    turn.addEventListener("click", () => setTurn(!scene.controls.autoRotate));
    scene.stop = () => scene.controls.autoRotate && setTurn(false);
    const reset = element(
        "button",
        {
            type: "button",
            class: "button",
            onclick: () => {
                scene.reset();
                scene.choose(null);
            },
        },
        "Reset",
    );
    const full = element(
        "button",
        { type: "button", class: "button full", onclick: () => stage.requestFullscreen() },
        "Full screen",
    );
    setMode("photograph");
    setTurn(!matchMedia("(prefers-reduced-motion: reduce)").matches);
    return element(
        "div",
        { class: "controls" },
        element("fieldset", { class: "segments" }, element("legend", {}, "Color"), ...choices),
        element("label", {}, "Point size", size),
        element("label", {}, cameras, "Cameras"),
        turn,
        reset,
        document.fullscreenEnabled ? full : null,
    );
}

function legendOf(mode) {
    switch (mode) {
        case "normal":
            return keyLegend("Normal", "direction in the world", [
                { label: "+x", color: [255, 128, 128] },
                { label: "+y", color: [128, 255, 128] },
                { label: "+z", color: [128, 128, 255] },
            ]);
        case "height": {
            const [low, high] = points.heights;
            return rampLegend(
                "Height",
                "units of the model",
                ticks(low, high),
                (value) => (value - low) / (high - low || 1),
            );
        }
        case "views":
            return rampLegend(
                "Views of a point",
                "number",
                ticks(0, points.mostSights).filter(Number.isInteger),
                (value) => value / points.mostSights,
            );
        case "confidence":
            return rampLegend("Confidence", "probability, 0 to 1", [0, 0.25, 0.5, 0.75, 1], (value) => value);
        default:
            return keyLegend("Photograph", "color of the points, 0 to 255", []);
    }
}

function note() {
    const parts = [
        `Positions are stored in 65,535 steps of the cloud's box, here within ` +
            `\u00b1${number(points.step / 2, 2)} units of the model; normals within about 1\u00b0.`,
    ];
    if (data.cloud.has_confidence)
        parts.push(
            "The confidence of a point is the mean of its views', which are read from their coarse " +
                "pictures, in steps of 0.004.",
        );
    else parts.push("Confidence: no maps of it in the folder of the run.");
    if (!data.cloud.has_views) parts.push("The views of the points are not known.");
    parts.push("Height is along the direction that is up in most photographs.");
    return parts.join(" ");
}

function interact(canvas, readout) {
    readout.textContent = "Move the cursor over a point or a camera for its values.";
    let pending = null;
    let chosen = -1;
    const read = () => {
        const { point, view } = scene.pick(...pending);
        pending = null;
        if (view !== chosen) scene.choose(view < 0 ? null : view);
        chosen = view;
        canvas.style.cursor = view >= 0 ? "pointer" : "grab";
        if (view >= 0) readout.textContent = `Camera of ${views[view].name}; click to open the view.`;
        else if (point >= 0) readout.textContent = describe(point);
    };
    canvas.addEventListener("pointermove", (event) => {
        if (event.buttons) return;
        const isFirst = pending === null;
        pending = [event.offsetX, event.offsetY];
        if (isFirst) requestAnimationFrame(read);
    });
    let start = null;
    canvas.addEventListener("pointerdown", (event) => {
        start = [event.clientX, event.clientY];
        scene.stop();
    });
    canvas.addEventListener("pointerup", (event) => {
        const isClick = start && length([event.clientX - start[0], event.clientY - start[1], 0]) < 4;
        if (!isClick) return;
        const { point, view } = scene.pick(event.offsetX, event.offsetY);
        if (view >= 0) openView(view);
        else if (point >= 0) readout.textContent = describe(point);
    });
    canvas.addEventListener("wheel", () => scene.controls.enableZoom && scene.stop(), { passive: true });
    canvas.addEventListener("keydown", (event) => {
        if (event.ctrlKey || event.altKey || event.metaKey || !scene.press(event)) return;
        event.preventDefault();
        scene.stop();
    });
    new IntersectionObserver(([{ isIntersecting }]) => {
        scene.isVisible = isIntersecting;
        if (isIntersecting) scene.draw();
    }).observe(canvas);
}

function describe(point) {
    const place = points.position(point).map((value) => number(value));
    const facts = [`Point (${place.join(", ")})`];
    if (data.cloud.has_views) facts.push(`seen by ${count(points.sights[point], "view")}`);
    const confidence = points.confidence(point);
    if (Number.isFinite(confidence)) facts.push(`confidence ${confidence.toFixed(2)}`);
    facts.push(`height ${number(points.height(point))}`);
    return facts.join(", ");
}

// Looks at the cloud through the camera of a view.
export function lookThrough(view) {
    if (!scene) return;
    scene.stop();
    scene.lookThrough(view);
    document.getElementById("cloud").scrollIntoView();
}
