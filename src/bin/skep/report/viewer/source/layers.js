// The layers of views: how their numbers become colors, values and legends.
//
// Maps are pictures of numbers. Depth: 0 is none, 1 to 255 are even steps of the logarithm between two depths
// of the view. Normal: three components in 64 steps. Sources: a number. Confidence: 0 is none, 1 to 51 are
// steps of 0.02. Status: its number.

import { data, hasBlob, picture, viewReport, views } from "./data.js";
import { number } from "./dom.js";
import { STATUSES, keyLegend, ramp, rampLegend, ticks } from "./colors.js";

const DEPTH_STEPS = 254;
const CONFIDENCE_STEPS = 50;
const NORMAL_STEPS = 63;

export const LAYERS = ["photograph", "depth", "normal", "sources", "confidence", "status"];
export const TITLES = {
    photograph: "Photo",
    depth: "Depth",
    normal: "Normal",
    sources: "Sources",
    confidence: "Confidence",
    status: "Status",
};
const MISSING = {
    photograph: "the photograph is not in the folder of the run",
    depth: "no depth map: --write depth",
    normal: "no normal map: --write normals",
    sources: "no picture of the numbers of source views: --write previews",
    confidence: "no confidence map: --write confidence",
    status: "no status map: --write status",
};

export const blobName = (view, layer) => `view-${view}-${layer}`;
export const hasLayer = (view, layer) => hasBlob(blobName(view, layer));
export const pixels = (view, layer) =>
    picture(blobName(view, layer), layer === "photograph" ? "image/jpeg" : "image/png");

// The scale of depths that all views share: outlying views do not stretch it.
const ranges = views.map(({ depth }) => depth).filter(Boolean);
const quantile = (values, share) => values.toSorted((a, b) => a - b)[Math.round((values.length - 1) * share)];
export const depthScale =
    ranges.length === 0
        ? null
        : [
              quantile(
                  ranges.map(([low]) => low),
                  0.05,
              ),
              quantile(
                  ranges.map(([, high]) => high),
                  0.95,
              ),
          ];
const isWide = depthScale && depthScale[1] > 4 * depthScale[0];
const depthShare = (depth) =>
    isWide
        ? Math.log(depth / depthScale[0]) / Math.log(depthScale[1] / depthScale[0])
        : (depth - depthScale[0]) / (depthScale[1] - depthScale[0]);

const mostSources = Math.max(1, ...views.map(({ sources }) => sources.length));

const depthOf = (view, value) => {
    const [low, high] = views[view].depth;
    return low * (high / low) ** ((value - 1) / DEPTH_STEPS);
};
// Half of a step of the logarithm, as a fraction of the depth.
const depthError = (view) => {
    const [low, high] = views[view].depth;
    return Math.log(high / low) / DEPTH_STEPS / 2;
};

const COLORS = {
    depth: (view) => {
        const table = Array.from({ length: 256 }, (_, value) =>
            value ? ramp(1 - depthShare(depthOf(view, value))) : null,
        );
        return (value) => table[value];
    },
    sources: () => (value) => (value ? ramp(value / mostSources) : null),
    confidence: () => (value) => (value ? ramp((value - 1) / CONFIDENCE_STEPS) : null),
    status: () => (value) => STATUSES[value]?.color ?? null,
};

// The picture of a layer in colors; what has no value is transparent. Null where the layer is missing.
export async function colored(view, layer) {
    const source = await pixels(view, layer);
    if (!source || layer === "photograph") return source;
    const made = new ImageData(source.width, source.height);
    const color = COLORS[layer]?.(view);
    for (let index = 0; index < made.data.length; index += 4) {
        const [red, green, blue] = source.data.subarray(index, index + 3);
        const found = color ? color(red) : red + green + blue > 0 ? [red, green, blue] : null;
        if (!found) continue;
        made.data.set(found, index);
        made.data[index + 3] = 255;
    }
    return made;
}

const VALUES = {
    photograph: (_, [red, green, blue]) => `red ${red}, green ${green}, blue ${blue}`,
    depth: (view, [value]) => {
        if (value === 0) return "no validated depth";
        const beyond = { 1: " or less", 255: " or more" }[value] ?? "";
        return `depth ${number(depthOf(view, value))}${beyond}`;
    },
    normal: (_, numbers) => {
        if (numbers[0] + numbers[1] + numbers[2] === 0) return "no validated normal";
        const [x, y, z] = numbers.map(
            (value, axis) => ((Math.floor(value / 4) / NORMAL_STEPS) * 2 - 1) * (axis ? -1 : 1),
        );
        const turned = (Math.acos(Math.min(1, -z / Math.hypot(x, y, z))) * 180) / Math.PI;
        const components = [x, y, z].map((value) => value.toFixed(2).replace("-", "\u2212")).join(", ");
        return `normal (${components}), ${turned.toFixed(0)}\u00b0 from the viewing direction`;
    },
    sources: (view, [value]) =>
        value ? `${value} of ${views[view].sources.length} source views` : "no validated depth",
    confidence: (_, [value]) =>
        value ? `confidence ${((value - 1) / CONFIDENCE_STEPS).toFixed(2)}` : "no validated depth",
    status: (_, [value]) =>
        STATUSES[value] ? `${STATUSES[value].label}: ${STATUSES[value].meaning}` : "unknown status",
};

// The value of a layer at a place of a view, both from 0 to 1, in words.
export async function valueAt(view, layer, [across, down]) {
    const { name, size, grid } = views[view];
    const column = Math.min(Math.max(Math.floor(across * grid[0]), 0), grid[0] - 1);
    const row = Math.min(Math.max(Math.floor(down * grid[1]), 0), grid[1] - 1);
    const source = await pixels(view, layer);
    if (!source) return { text: `${name}: ${missing(view, layer)}`, column, row };
    const start = 4 * (row * grid[0] + column);
    const numbers = [...source.data.subarray(start, start + 3)];
    const x = Math.floor(((2 * column + 1) * size[0]) / (2 * grid[0]));
    const y = Math.floor(((2 * row + 1) * size[1]) / (2 * grid[1]));
    return { text: `${name}, pixel ${x}, ${y}: ${VALUES[layer](view, numbers)}`, column, row };
}

// Why a layer of a view is missing.
export function missing(view, layer) {
    if (data.left_out > 0 && !LAYERS.some((name) => hasLayer(view, name)))
        return "left out, as the page would be larger than 25 MB";
    if (layer === "photograph") return MISSING.photograph;
    if (!views[view].finished) return "not finished yet";
    if (layer === "sources" && data.complete === false) return "known when the run is complete";
    return MISSING[layer];
}

// The legend of a layer, and what its values are exact to.
export function legend(layer) {
    const ranged = views.map((_, view) => view).filter((view) => views[view].depth);
    switch (layer) {
        case "depth": {
            if (!depthScale) return { legend: null, note: "No view has a validated depth." };
            const worst = Math.max(...ranged.map(depthError));
            return {
                legend: rampLegend(
                    "Depth",
                    "units of the model",
                    ticks(...depthScale, isWide),
                    depthShare,
                    true,
                ),
                note:
                    `Distance along the viewing direction. Values are stored in 254 steps between the ` +
                    `1st and 99th percentile of each view: within \u00b1${number(100 * worst, 2)} %. ` +
                    `Hatched: not validated.`,
            };
        }
        case "normal":
            return {
                legend: keyLegend("Normal", "direction of the surface", [
                    { label: "to the right", color: [254, 128, 128] },
                    { label: "up", color: [128, 254, 128] },
                    { label: "to the camera", color: [128, 128, 254] },
                ]),
                note:
                    "In the camera's frame: x right, y down, z forward. Components are stored in 64 " +
                    "steps: within \u00b10.016, about 1\u00b0.",
            };
        case "sources":
            return {
                legend: rampLegend("Source views", "number", sourceTicks(), (value) => value / mostSources),
                note:
                    "Other views that see the pixel's surface and were used for it; whole numbers, " +
                    "stored as they are.",
            };
        case "confidence":
            return {
                legend: rampLegend(
                    "Confidence",
                    "probability, 0 to 1",
                    [0, 0.25, 0.5, 0.75, 1],
                    (value) => value,
                ),
                note:
                    "Probability that the depth is within 1 % of the truth. Stored in steps of 0.02: " +
                    "within \u00b10.01.",
            };
        case "status":
            return {
                legend: keyLegend("Status", "of each pixel", STATUSES),
                note: "Validated, or the reason why not. Stored as it is.",
            };
        default:
            return {
                legend: keyLegend("Photograph", "color, 0 to 255", []),
                note:
                    "As it was matched, reduced: each pixel here is the mean of those under it, and " +
                    "JPEG changes colors a little.",
            };
    }
}

function sourceTicks() {
    const step = Math.ceil(mostSources / 5);
    const values = [];
    for (let value = 0; value < mostSources; value += step) values.push(value);
    if (mostSources - values.at(-1) < step / 2) values.pop();
    return [...values, mostSources];
}

// Figures of a view for its caption.
export const sourcesOf = (view) => views[view].sources.length;
export const rangeOf = (view) => {
    const { depth_min: low, depth_max: high } = viewReport(view);
    return Number.isFinite(low) ? `${number(low, 3)} to ${number(high, 3)}` : "unknown";
};
