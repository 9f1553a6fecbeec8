// Convergence by cycle, and time by stage.

import { report } from "./data.js";
import { element, percent, seconds, section, shape } from "./dom.js";

const STAGES = { reading: "Reading", search: "Search", check: "Check", fusion: "Fusion", writing: "Writing" };

export function charts() {
    const cycles = report.totals?.cycles ?? [];
    const phases = report.phases;
    if (cycles.length === 0 && !phases) return;
    const parts = [cycles.length ? convergence(cycles) : null, phases ? times(phases) : null].filter(Boolean);
    section("course", "Course of the run", null, element("div", { class: "split" }, ...parts));
}

function convergence(cycles) {
    const [width, height, left, right, top, bottom] = [560, 250, 44, 12, 26, 40];
    const x = (index) =>
        left + (cycles.length === 1 ? 0.5 : index / (cycles.length - 1)) * (width - left - right);
    const y = (share) => top + (1 - share) * (height - top - bottom);
    const lines = [
        {
            name: "validated",
            color: "var(--line-b)",
            dash: null,
            share: (cycle) => cycle.validated / cycle.pixels,
        },
        {
            name: "changed by the cycle",
            color: "var(--line-a)",
            dash: "6 4",
            share: (cycle) => cycle.changed / cycle.pixels,
        },
    ];
    const chart = shape(
        "svg",
        { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-labelledby": "convergence-title" },
        shape(
            "title",
            { id: "convergence-title" },
            `Convergence: ${cycles.length} cycles; at the end ${percent(lines[0].share(cycles.at(-1)))} ` +
                `validated, ${percent(lines[1].share(cycles.at(-1)))} changed`,
        ),
    );
    for (const share of [0, 0.25, 0.5, 0.75, 1]) {
        chart.append(
            shape("line", { class: "gridline", x1: left, x2: width - right, y1: y(share), y2: y(share) }),
            shape("text", { x: left - 6, y: y(share) + 4, "text-anchor": "end" }, `${100 * share} %`),
        );
    }
    cycles.forEach((cycle, index) => {
        const isFirst = index === 0 || cycles[index - 1].downscale !== cycle.downscale;
        if (isFirst) {
            const name = cycle.downscale === 1 ? "full size" : `1/${cycle.downscale} size`;
            const at = index === 0 ? left : (x(index - 1) + x(index)) / 2;
            if (index > 0)
                chart.append(
                    shape("line", {
                        class: "axis",
                        x1: at,
                        x2: at,
                        y1: top,
                        y2: height - bottom,
                        "stroke-dasharray": "2 3",
                    }),
                );
            chart.append(shape("text", { class: "strong", x: at + 4, y: height - 6 }, name));
        }
        chart.append(
            shape("text", { x: x(index), y: height - bottom + 16, "text-anchor": "middle" }, cycle.cycle + 1),
        );
    });
    lines.forEach(({ name, color, dash, share }, index) => {
        const points = cycles.map((cycle, index) => `${x(index)},${y(Math.min(share(cycle), 1))}`);
        chart.append(
            shape("polyline", {
                points: points.join(" "),
                fill: "none",
                stroke: color,
                "stroke-width": 2.5,
                "stroke-dasharray": dash,
            }),
        );
        cycles.forEach((cycle, place) =>
            chart.append(
                shape(
                    "circle",
                    { cx: x(place), cy: y(Math.min(share(cycle), 1)), r: 3.5, fill: color },
                    shape("title", {}, `cycle ${place + 1}: ${percent(share(cycle))} ${name}`),
                ),
            ),
        );
        const at = left + index * 150;
        chart.append(
            shape("line", {
                x1: at,
                x2: at + 22,
                y1: 10,
                y2: 10,
                stroke: color,
                "stroke-width": 2.5,
                "stroke-dasharray": dash,
            }),
            shape("text", { class: "strong", x: at + 28, y: 14 }, name),
        );
    });
    const row = (cycle) =>
        element(
            "tr",
            {},
            element("td", {}, cycle.downscale === 1 ? "full" : `1/${cycle.downscale}`),
            element("td", {}, cycle.cycle + 1),
            ...lines.map(({ share }) => element("td", {}, percent(share(cycle)))),
        );
    const table = element(
        "table",
        {},
        element(
            "thead",
            {},
            element(
                "tr",
                {},
                ...["Size", "Cycle", "Validated", "Changed"].map((name) =>
                    element("th", { scope: "col" }, name),
                ),
            ),
        ),
        element("tbody", {}, ...cycles.map(row)),
    );
    return element(
        "div",
        {},
        element("h3", {}, "Convergence"),
        element(
            "p",
            { class: "quiet" },
            "Share of the pixels with a plane. A search that converged changes few pixels in its last cycle.",
        ),
        chart,
        element("details", {}, element("summary", {}, "As a table"), table),
    );
}

function times(phases) {
    const entries = Object.entries(STAGES)
        .map(([key, name]) => ({ name, ...phases[key] }))
        .filter(({ wall_seconds: wall }) => Number.isFinite(wall));
    const all = entries.reduce((sum, { wall_seconds: wall }) => sum + wall, 0);
    const cpu = entries.reduce((sum, { cpu_seconds: cpu }) => sum + cpu, 0);
    const most = Math.max(...entries.map(({ wall_seconds: wall }) => wall), 1e-9);
    const row = ({ name, wall_seconds: wall }) =>
        element(
            "li",
            {},
            element("span", {}, name),
            element(
                "span",
                {},
                element("span", {
                    class: "bar",
                    style: { width: `${(100 * wall) / most}%`, display: "block" },
                }),
            ),
            element("span", {}, `${seconds(wall)}, ${((100 * wall) / all).toFixed(0)} %`),
        );
    return element(
        "div",
        {},
        element("h3", {}, "Time by stage"),
        element(
            "p",
            { class: "quiet" },
            `${seconds(all)} in all, ${seconds(cpu)} of CPU on ${report.threads} threads.`,
        ),
        element("ul", { class: "stages" }, ...entries.map(row)),
    );
}
