// All views under one slider of layers.

import { validatedShare, viewReport, views } from "./data.js";
import { element, percent, section } from "./dom.js";
import { statusBar } from "./colors.js";
import { LAYERS, TITLES, colored, hasLayer, legend, missing, valueAt } from "./layers.js";
import { openView } from "./dialog.js";

// Letters of a name in a caption.
const MOST_LETTERS = 20;

// The layer that is shown, and who repaints when it changes.
let current = LAYERS[0];
const listeners = new Set();
export const layer = () => current;
export const onLayer = (listener) => listeners.add(listener);

export function setLayer(name) {
    current = name;
    for (const listener of listeners) listener();
}

// A slider of layers; `id` makes its elements unique.
export function layerSlider(id) {
    const input = element("input", {
        type: "range",
        id,
        min: 0,
        max: LAYERS.length - 1,
        step: 1,
        "aria-label": "Layer shown in every view",
        oninput: () => setLayer(LAYERS[input.value]),
    });
    const stops = LAYERS.map((name, index) =>
        element(
            "button",
            {
                type: "button",
                tabindex: "-1",
                "data-layer": name,
                onclick: () => setLayer(name),
                style: { left: `${(100 * index) / (LAYERS.length - 1)}%` },
            },
            TITLES[name],
        ),
    );
    const show = () => {
        input.value = LAYERS.indexOf(current);
        input.setAttribute("aria-valuetext", TITLES[current]);
        stops.forEach((stop) => stop.classList.toggle("now", stop.dataset.layer === current));
    };
    onLayer(show);
    show();
    return element("div", { class: "slider" }, input, element("div", { class: "stops" }, ...stops));
}

// Paints a layer of a view; says so where it is missing.
export async function paint(canvas, view, name) {
    const wanted = `${view} ${name}`;
    canvas.dataset.wanted = wanted;
    const image = await colored(view, name);
    if (canvas.dataset.wanted !== wanted) return;
    const [width, height] = views[view].grid;
    canvas.width = width;
    canvas.height = height;
    canvas.classList.toggle("photograph", name === "photograph");
    if (image) canvas.getContext("2d").putImageData(image, 0, 0);
    canvas.dataset.shown = wanted;
}

export function gallery() {
    const legendPlace = element("div", { id: "layer-legend" });
    const note = element("p", { class: "quiet", id: "layer-note" });
    const readout = element("p", { class: "readout", id: "layer-value" });
    const hint =
        "Move the cursor over a view for its values; open one to see it large and read values with the " +
        "arrow keys.";
    const tiles = views.map((view, index) => tile(view, index, readout));
    const visible = new Set();
    const repaint = (canvas) => paint(canvas, Number(canvas.dataset.view), current);
    const observer = new IntersectionObserver(
        (entries) => {
            for (const { isIntersecting, target } of entries) {
                if (isIntersecting) {
                    visible.add(target);
                    repaint(target);
                } else visible.delete(target);
            }
        },
        { rootMargin: "300px" },
    );
    tiles.forEach(({ canvas }) => observer.observe(canvas));
    const show = () => {
        const found = legend(current);
        legendPlace.replaceChildren(...(found.legend ? [found.legend] : []));
        const lacking = views.map((_, view) => view).filter((view) => !hasLayer(view, current));
        const lacks = lacking.length
            ? ` Missing for ${lacking.length} of ${views.length} views: ${missing(lacking[0], current)}.`
            : "";
        note.textContent = found.note + lacks;
        readout.textContent = hint;
        visible.forEach(repaint);
    };
    onLayer(show);
    const list = element(
        "ul",
        { class: views.length > 40 ? "gallery many" : "gallery" },
        ...tiles.map(({ item }) => item),
    );
    section(
        "views",
        "Views",
        null,
        element("div", { class: "layers" }, layerSlider("layer")),
        element("div", { class: "under" }, legendPlace, element("div", {}, readout, note)),
        list,
    );
    show();
}

function tile(view, index, readout) {
    const canvas = element("canvas", {
        class: "map",
        width: view.grid[0],
        height: view.grid[1],
        "data-view": index,
    });
    canvas.style.aspectRatio = `${view.grid[0]} / ${view.grid[1]}`;
    const share = validatedShare(index);
    const { status_counts: counts } = viewReport(index);
    const button = element(
        "button",
        { class: "view", type: "button", onclick: () => openView(index) },
        canvas,
        element(
            "span",
            { class: "caption" },
            element("span", { title: view.name }, short(view.name)),
            element(
                "span",
                {},
                view.finished && Number.isFinite(share)
                    ? percent(share)
                    : view.finished
                      ? ""
                      : "not finished",
            ),
        ),
    );
    if (counts) {
        const bar = statusBar(counts);
        bar.setAttribute("aria-hidden", "true");
        button.append(bar);
    }
    let latest = 0;
    canvas.addEventListener("pointermove", async (event) => {
        const turn = ++latest;
        const value = await valueAt(index, current, placeOf(canvas, event));
        if (turn === latest) readout.textContent = value.text;
    });
    return { item: element("li", {}, button), canvas };
}

// A name whose end can be read: that is what differs.
function short(name) {
    return name.length > MOST_LETTERS ? `\u2026${name.slice(1 - MOST_LETTERS)}` : name;
}

// The place of an event in a canvas, from 0 to 1.
export function placeOf(canvas, event) {
    const box = canvas.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
}
