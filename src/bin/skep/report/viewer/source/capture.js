// The geometry of the capture: cameras from above with the views that overlap, and angles between rays.

import { data, validatedShare, views } from "./data.js";
import { count, element, number, percent, section, shape } from "./dom.js";
import { css, ramp, rampLegend } from "./colors.js";
import { openView } from "./dialog.js";
import { facts, position, total } from "./points.js";
import { dot, groundPlane, mean, subtract } from "./vectors.js";

// Links that are drawn, at most: those of the most points.
const MOST_LINKS = 1500;
const MOST_DOTS = 1200;

export function capture() {
    const { geometry } = data;
    const parts = [cameraMap(geometry), histogram(geometry)];
    section("capture", "Geometry of the capture", null, element("div", { class: "split" }, ...parts));
}

function cameraMap({ links, has_tracks: hasTracks, parts }) {
    const up = facts.up;
    const [right, ahead] = groundPlane(up, mean(views.map(({ axes }) => axes[2])));
    const origin = mean(views.map(({ center }) => center));
    const flat = (place) => {
        const from = subtract(place, origin);
        return [dot(from, right), -dot(from, ahead)];
    };
    const cameras = views.map(({ center }) => flat(center));
    const skip = Math.max(1, Math.floor(total / MOST_DOTS));
    const dots = [];
    for (let point = 0; point < total; point += skip) dots.push(flat(position(point)));
    // Points far off do not shrink the map: it reaches three times the extent of the cameras beyond them.
    const extent = Math.max(
        ...[0, 1].map(
            (axis) =>
                Math.max(...cameras.map((place) => place[axis])) -
                Math.min(...cameras.map((place) => place[axis])),
        ),
    );
    const [width, height, edge] = [560, 400, 24];
    const bounds = [0, 1].map((axis) => {
        const own = cameras.map((place) => place[axis]);
        const others = dots.map((place) => place[axis]).sort((a, b) => a - b);
        const at = (share) => others[Math.round((others.length - 1) * share)];
        const [low, high] = [Math.min(...own), Math.max(...own)];
        const reach = extent > 0 ? 3 * extent : Infinity;
        return [
            Math.min(low, Math.max(at(0.05) ?? low, low - reach)),
            Math.max(high, Math.min(at(0.95) ?? high, high + reach)),
        ];
    });
    const spans = bounds.map(([low, high]) => high - low || 1);
    const factor = Math.min((width - 2 * edge) / spans[0], (height - 2 * edge) / spans[1]);
    const toMap = (place) =>
        place.map(
            (value, axis) =>
                [width, height][axis] / 2 + (value - (bounds[axis][0] + bounds[axis][1]) / 2) * factor,
        );
    const label =
        `Camera map: ${count(views.length, "camera")} from above, ` +
        `${count(links.length, "pair")} that see the same points`;
    const map = shape("svg", {
        viewBox: `0 0 ${width} ${height}`,
        role: "img",
        "aria-label": label,
        id: "camera-map",
    });
    for (const place of dots) {
        const [x, y] = toMap(place);
        if (x < 0 || y < 0 || x > width || y > height) continue;
        map.append(
            shape("circle", {
                cx: x.toFixed(1),
                cy: y.toFixed(1),
                r: 1.1,
                fill: "var(--quiet)",
                opacity: 0.35,
            }),
        );
    }
    const most = Math.max(1, ...links.map(([, , shared]) => shared));
    const drawn = links.toSorted((a, b) => b[2] - a[2]).slice(0, MOST_LINKS);
    for (const [first, second, shared, angle] of drawn.reverse()) {
        const [[x1, y1], [x2, y2]] = [first, second].map((view) => toMap(cameras[view]));
        const title =
            `${views[first].name} and ${views[second].name}: ` +
            `${count(shared, "common point")}, ${number(angle, 3)}\u00b0`;
        map.append(
            shape(
                "line",
                {
                    x1,
                    y1,
                    x2,
                    y2,
                    stroke: "var(--accent)",
                    "stroke-width": 0.6 + 2.2 * Math.sqrt(shared / most),
                    opacity: 0.2 + (0.55 * shared) / most,
                },
                shape("title", {}, title),
            ),
        );
    }
    const size = Math.min(10, Math.max(4, 90 / Math.sqrt(views.length)));
    views.forEach(({ name, axes }, view) => {
        const [x, y] = toMap(cameras[view]);
        const [dx, dy] = [dot(axes[2], right), -dot(axes[2], ahead)];
        const turn = (Math.atan2(dy, dx) * 180) / Math.PI;
        const share = validatedShare(view);
        const color = Number.isFinite(share) ? css(ramp(share)) : "var(--sunken)";
        const flatness = Math.hypot(dx, dy);
        const path =
            flatness > 0.2
                ? `M${size} 0L${-size * 0.7} ${size * 0.7}L${-size * 0.7} ${-size * 0.7}Z`
                : `M${size * 0.7} 0A${size * 0.7} ${size * 0.7} 0 1 1 ${size * 0.7} -0.01Z`;
        const mark = shape(
            "path",
            {
                d: path,
                transform: `translate(${x} ${y}) rotate(${turn})`,
                fill: color,
                stroke: "var(--text)",
                "stroke-width": 1,
                cursor: "pointer",
            },
            shape("title", {}, `${name}${Number.isFinite(share) ? `: ${percent(share)} validated` : ""}`),
        );
        mark.addEventListener("click", () => openView(view));
        map.append(mark);
    });
    const unconnected = parts > 1 && hasTracks ? ` They fall into ${parts} parts without common points.` : "";
    const text = hasTracks
        ? `From above; triangles look along the viewing direction, circles up or down. A line joins ` +
          `views that see the same sparse points, wider for more.${unconnected}`
        : "From above; triangles look along the viewing direction. The model has no points that views " +
          "share, so no overlap is drawn.";
    const cells = views.some((_, view) => Number.isFinite(validatedShare(view)));
    return element(
        "div",
        {},
        element("h3", {}, "Camera map and overlap"),
        element("p", { class: "quiet" }, text),
        map,
        cells
            ? rampLegend(
                  "Validated pixels of the camera",
                  "percent",
                  [0, 25, 50, 75, 100],
                  (value) => value / 100,
              )
            : null,
    );
}

function histogram({ bin, bins, has_tracks: hasTracks }) {
    const all = bins.reduce((sum, value) => sum + value, 0);
    const text = hasTracks
        ? "Angle between the rays of a view and each of its sources, the mean at their common sparse points."
        : "Angle between the rays of a view and each of its sources, at the middle of its depths.";
    if (all === 0)
        return element(
            "div",
            {},
            element("h3", {}, "Triangulation angles"),
            element("p", { class: "notice" }, "No angles are known: neither common points nor depths."),
        );
    const last = Math.max(10, bins.findLastIndex((value) => value > 0) + 1);
    const used = bins.slice(0, last);
    const [width, height, left, right, top, bottom] = [560, 270, 40, 16, 24, 42];
    const most = Math.max(...used);
    const x = (angle) => left + (angle / (bin * last)) * (width - left - right);
    const y = (value) => top + (1 - value / most) * (height - top - bottom);
    let below = 0;
    const median = bin * (used.findIndex((value) => (below += value) >= all / 2) + 0.5);
    const label =
        `Triangulation angles of ${count(all, "pair")} of view and source, the median about ` +
        `${median} degrees`;
    const chart = shape("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label });
    chart.append(
        shape("rect", {
            x: x(5),
            y: top,
            width: x(20) - x(5),
            height: height - top - bottom,
            fill: "var(--sunken)",
        }),
        shape(
            "text",
            { x: (x(5) + x(20)) / 2, y: top - 8, "text-anchor": "middle" },
            "5\u00b0 to 20\u00b0: good",
        ),
    );
    used.forEach((value, index) => {
        if (!value) return;
        chart.append(
            shape(
                "rect",
                {
                    x: x(bin * index) + 1,
                    y: y(value),
                    width: x(bin) - x(0) - 2,
                    height: y(0) - y(value),
                    fill: "var(--bar)",
                    rx: 2,
                },
                shape(
                    "title",
                    {},
                    `${bin * index}\u00b0 to ${bin * (index + 1)}\u00b0: ${count(value, "pair")}`,
                ),
            ),
        );
    });
    chart.append(shape("line", { class: "axis", x1: left, x2: width - right, y1: y(0), y2: y(0) }));
    const every = last > 15 ? 10 : 5;
    for (let angle = 0; angle <= bin * last; angle += every) {
        chart.append(
            shape(
                "text",
                { x: x(angle), y: height - bottom + 16, "text-anchor": "middle" },
                `${angle}\u00b0`,
            ),
        );
    }
    chart.append(
        shape("text", { x: left - 6, y: y(most) + 10, "text-anchor": "end" }, most),
        shape("text", { x: left - 6, y: y(0), "text-anchor": "end" }, 0),
        shape(
            "text",
            { class: "strong", x: (left + width) / 2, y: height - 6, "text-anchor": "middle" },
            "angle; pairs of a view and one of its sources",
        ),
    );
    return element(
        "div",
        {},
        element("h3", {}, "Triangulation angles"),
        element(
            "p",
            { class: "quiet" },
            `${text} Small angles make depths uncertain, large ones make surfaces look different. The ` +
                `median is about ${number(median)}\u00b0.`,
        ),
        chart,
    );
}
