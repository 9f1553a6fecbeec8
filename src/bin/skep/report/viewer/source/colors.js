// Scales of colors, and their legends.

import { element, number } from "./dom.js";

// Even in lightness, from dark to bright; readable by people with any color vision.
const RAMP = [
    [48, 18, 94],
    [58, 64, 158],
    [26, 118, 172],
    [24, 168, 138],
    [134, 206, 72],
    [252, 236, 84],
];

// The color at a fraction of the scale.
export function ramp(share) {
    const place = Math.min(Math.max(share, 0), 1) * (RAMP.length - 1);
    const index = Math.min(Math.floor(place), RAMP.length - 2);
    const part = place - index;
    return RAMP[index].map((from, channel) => Math.round(from + (RAMP[index + 1][channel] - from) * part));
}

export const css = ([red, green, blue]) => `rgb(${red} ${green} ${blue})`;

// In the order of their numbers.
export const STATUSES = [
    { name: "validated", label: "validated", color: [11, 143, 104], meaning: "confirmed by other views" },
    { name: "masked", label: "masked", color: [139, 148, 161], meaning: "excluded by a mask" },
    { name: "no_texture", label: "no texture", color: [74, 163, 220], meaning: "too uniform to be matched" },
    {
        name: "no_sources",
        label: "no sources",
        color: [224, 160, 25],
        meaning: "seen by too few other views",
    },
    { name: "inconsistent", label: "inconsistent", color: [207, 90, 16], meaning: "other views disagree" },
    {
        name: "out_of_range",
        label: "out of range",
        color: [185, 100, 154],
        meaning: "at an end of the depth range",
    },
];

// A scale with its values: `at` gives the fraction of the scale for a value.
export function rampLegend(name, unit, values, at, reversed = false) {
    const stops = [0, 0.2, 0.4, 0.6, 0.8, 1].map((share) => css(ramp(reversed ? 1 - share : share)));
    const ticks = values.map((value) =>
        element("span", { style: { left: `${100 * at(value)}%` } }, number(value, 3)),
    );
    return element(
        "div",
        { class: "legend" },
        element(
            "div",
            { class: "name" },
            element("strong", {}, name),
            element("span", { class: "unit" }, unit),
        ),
        element("div", {
            class: "ramp",
            style: { background: `linear-gradient(90deg, ${stops.join(", ")})` },
        }),
        element("div", { class: "ticks" }, ...ticks),
    );
}

export function keyLegend(name, unit, keys) {
    const entries = keys.map(({ label, color }) =>
        element("li", {}, element("span", { class: "swatch", style: { background: css(color) } }), label),
    );
    return element(
        "div",
        { class: "legend" },
        element(
            "div",
            { class: "name" },
            element("strong", {}, name),
            element("span", { class: "unit" }, unit),
        ),
        element("ul", { class: "keys" }, ...entries),
    );
}

// Round values inside a range, few of them, and its ends.
export function ticks(low, high, isLogarithmic = false) {
    const middle = [1, 2, 3].map((step) => {
        const share = step / 4;
        return isLogarithmic ? low * (high / low) ** share : low + (high - low) * share;
    });
    return [low, ...middle, high];
}

// A bar of the statuses of a view or of all.
export function statusBar(counts) {
    const all = Object.values(counts).reduce((sum, value) => sum + value, 0) || 1;
    const parts = STATUSES.filter(({ name }) => counts[name] > 0);
    const label = parts
        .map(({ name, label }) => `${label} ${((100 * counts[name]) / all).toFixed(1)} %`)
        .join(", ");
    const spans = parts.map(({ name }) =>
        element("span", { style: { width: `${(100 * counts[name]) / all}%`, background: `var(--${name})` } }),
    );
    return element("div", { class: "status", role: "img", "aria-label": label, title: label }, ...spans);
}
