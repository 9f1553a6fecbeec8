// One view, large: its layers, its figures, and values under the cursor or a cross that keys move.

import { validatedShare, viewReport, views } from "./data.js";
import { count, element, number, percent } from "./dom.js";
import { STATUSES, statusBar } from "./colors.js";
import { layer, layerSlider, onLayer, paint, placeOf } from "./gallery.js";
import { legend, rangeOf, valueAt } from "./layers.js";
import { lookThrough } from "./cloud.js";

const dialog = document.getElementById("view-dialog");
let shown = 0;
let parts = null;
// Cell of the cross.
let cross = [0, 0];

export function openView(view) {
    if (!parts) build();
    show(view);
    if (!dialog.open) dialog.showModal();
}

function build() {
    const button = (text, label, action) =>
        element("button", { class: "button", type: "button", "aria-label": label, onclick: action }, text);
    const title = element("h2", { id: "view-name" });
    const canvas = element("canvas", { class: "map", tabindex: "0", role: "img", id: "view-canvas" });
    const value = element("p", { class: "readout", id: "view-value", "aria-live": "polite" });
    const facts = element("p", { class: "quiet" });
    const bar = element("div");
    const legendPlace = element("div");
    const step = (by) => show((shown + by + views.length) % views.length);
    dialog.replaceChildren(
        element(
            "div",
            { class: "row" },
            title,
            element(
                "div",
                { class: "row" },
                button("\u2190", "Previous view", () => step(-1)),
                button("\u2192", "Next view", () => step(1)),
                button("Look through", "Look through this camera at the cloud", () => {
                    dialog.close();
                    lookThrough(shown);
                }),
                button("Close", "Close", () => dialog.close()),
            ),
        ),
        layerSlider("view-layer"),
        canvas,
        value,
        bar,
        facts,
        legendPlace,
    );
    parts = { title, canvas, value, facts, bar, legendPlace };
    onLayer(() => dialog.open && show(shown));
    canvas.addEventListener("pointermove", (event) => read(placeOf(canvas, event), false));
    canvas.addEventListener("keydown", moveCross);
}

function show(view) {
    shown = view;
    const { title, canvas, facts, bar, legendPlace } = parts;
    const { name, size, grid, angle, points, sources } = views[view];
    const report = viewReport(view);
    title.textContent = name;
    canvas.style.width = `min(100%, ${((62 * grid[0]) / grid[1]).toFixed(1)}vh)`;
    cross = [Math.floor(grid[0] / 2), Math.floor(grid[1] / 2)];
    canvas.setAttribute(
        "aria-label",
        `${name}, layer ${layer()}; arrow keys move the place whose value is read`,
    );
    paint(canvas, view, layer()).then(() => read([0.5, 0.5], false));
    const counts = report.status_counts;
    bar.replaceChildren(...(counts ? [statusBar(counts)] : []));
    const residual = report.cycles?.at(-1)?.median_residual;
    const known = [
        `${size[0]} \u00d7 ${size[1]} pixels`,
        Number.isFinite(validatedShare(view)) ? `${percent(validatedShare(view))} validated` : null,
        count(sources.length, "source view"),
        angle === null ? null : `${number(angle, 3)}\u00b0 between rays in the median`,
        rangeOf(view) === "unknown" ? null : `depths from ${rangeOf(view)} searched`,
        Number.isFinite(residual) ? `median residual ${number(residual, 2)} px` : null,
        count(points, "sparse point"),
    ];
    const all = Object.values(counts ?? {}).reduce((sum, value) => sum + value, 0);
    const reasons = counts
        ? STATUSES.filter(({ name }) => counts[name]).map(
              ({ name, label }) => `${label} ${((100 * counts[name]) / all).toFixed(1)} %`,
          )
        : [];
    facts.textContent = `${known.filter(Boolean).join(" \u00b7 ")}. ${reasons.join(", ")}`;
    const found = legend(layer());
    legendPlace.replaceChildren(
        ...(found.legend ? [found.legend] : []),
        element("p", { class: "quiet" }, found.note),
    );
}

async function read(place, isCross) {
    const value = await valueAt(shown, layer(), place);
    parts.value.textContent = value.text;
    if (isCross) await drawCross();
}

function moveCross(event) {
    const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const move = moves[event.key];
    if (!move) return;
    event.preventDefault();
    const { grid } = views[shown];
    const step = event.shiftKey ? 10 : 1;
    cross = cross.map((cell, axis) => Math.min(Math.max(cell + step * move[axis], 0), grid[axis] - 1));
    read(
        cross.map((cell, axis) => (cell + 0.5) / grid[axis]),
        true,
    );
}

async function drawCross() {
    const { canvas } = parts;
    await paint(canvas, shown, layer());
    const context = canvas.getContext("2d");
    const [x, y] = cross.map((cell) => cell + 0.5);
    for (const [style, width] of [
        ["#000", 3],
        ["#fff", 1],
    ]) {
        context.strokeStyle = style;
        context.lineWidth = width;
        context.beginPath();
        for (const [fromX, fromY] of [
            [-9, 0],
            [3, 0],
            [0, -9],
            [0, 3],
        ]) {
            context.moveTo(x + fromX, y + fromY);
            context.lineTo(x + fromX + (fromX ? 6 : 0), y + fromY + (fromY ? 6 : 0));
        }
        context.stroke();
    }
}
