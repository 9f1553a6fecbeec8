// The points of the cloud: what the file holds of them, and their colors.
//
// Coordinates: 16 bits each in the box of the points. Normals: octahedral, 8 bits twice. Number of views: a
// byte. Confidence: 0 is none, 1 to 255 are steps of 1/254.

import { blob, data } from "./data.js";
import { ramp } from "./colors.js";
import { dot } from "./vectors.js";

export const facts = data.cloud;
const bytes = blob("cloud") ?? new Uint8Array();
export const total = facts.points;

// Offsets of the parts.
const at = [6, 3, 2, 1, 1].reduce((offsets, size) => [...offsets, offsets.at(-1) + size * total], [0]);
const coordinates = new Uint16Array(bytes.buffer, 0, 3 * total);
export const photograph = bytes.subarray(at[1], at[2]);
const normals = bytes.subarray(at[2], at[3]);
export const sights = bytes.subarray(at[3], at[4]);
const confidences = bytes.subarray(at[4], at[5]);

// Positions relative to the middle of the box, as floats keep them.
export const middle = facts.min.map((low, axis) => low + facts.size[axis] / 2);
export const local = new Float32Array(3 * total);
for (let index = 0; index < 3 * total; index++) {
    local[index] = facts.size[index % 3] * (coordinates[index] / 65535 - 0.5);
}
export const position = (point) => middle.map((value, axis) => value + local[3 * point + axis]);
export const step = Math.max(...facts.size) / 65535;
export const confidence = (point) => (confidences[point] ? (confidences[point] - 1) / 254 : NaN);

export function normal(point) {
    const [u, v] = [normals[2 * point], normals[2 * point + 1]].map((value) => (value - 128) / 127);
    const z = 1 - Math.abs(u) - Math.abs(v);
    const fold = Math.max(-z, 0);
    const found = [u - Math.sign(u) * fold, v - Math.sign(v) * fold, z];
    const size = Math.hypot(...found);
    return found.map((value) => value / size);
}

export const height = (point) => dot(facts.up, position(point));

// The value below which a share of the points lies, of a sample.
export function quantiles(value, shares) {
    const skip = Math.max(1, Math.floor(total / 5000));
    const values = [];
    for (let point = 0; point < total; point += skip) {
        const found = value(point);
        if (Number.isFinite(found)) values.push(found);
    }
    values.sort((a, b) => a - b);
    return shares.map((share) => values[Math.round((values.length - 1) * share)] ?? 0);
}

const GRAY = [120, 126, 134];
export const heights = quantiles(height, [0.01, 0.99]);
export const mostSights = Math.max(2, quantiles((point) => sights[point], [0.995])[0]);

const byValue = (share) => {
    const table = Array.from({ length: 256 }, (_, index) => ramp(index / 255));
    return (point) => {
        const found = share(point);
        return Number.isFinite(found) ? table[Math.round(255 * Math.min(Math.max(found, 0), 1))] : GRAY;
    };
};

const MODES = {
    photograph: () => (point) => photograph.subarray(3 * point, 3 * point + 3),
    normal: () => (point) => normal(point).map((value) => 127.5 + 127.5 * value),
    height: () => byValue((point) => (height(point) - heights[0]) / (heights[1] - heights[0] || 1)),
    views: () => byValue((point) => sights[point] / mostSights),
    confidence: () => byValue(confidence),
};

// The colors of all points in a mode, three bytes each.
export function colors(mode) {
    const found = new Uint8Array(3 * total);
    const color = MODES[mode]();
    for (let point = 0; point < total; point++) found.set(color(point), 3 * point);
    return found;
}
