// The head of the page: what was reconstructed, the figures of the whole run, and warnings with remedies.

import { data, report, views } from "./data.js";
import { bytes, count, element, number, percent, seconds, section } from "./dom.js";
import { openView } from "./dialog.js";

export function overview() {
    const totals = report.totals ?? {};
    const settings = report.preset ? `preset ${report.preset}` : report.options ? "own options" : null;
    const machine = report.threads ? `${count(report.threads, "thread")}, SIMD level ${report.simd}` : null;
    const facts = [`skep ${report.version ?? data.version}`, settings, machine];
    document.getElementById("subtitle").textContent = facts.filter(Boolean).join(" \u00b7 ");
    if (data.complete === false) badge();
    const counts = totals.status_counts ?? {};
    const all = Object.values(counts).reduce((sum, value) => sum + value, 0) - (counts.masked ?? 0);
    const pixels = views.reduce((sum, view) => sum + view.size[0] * view.size[1], 0);
    const tiles = [
        ["Views", number(views.length), `${(pixels / 1e6).toFixed(1)} megapixels`],
        [
            "Validated pixels",
            percent(counts.validated / all),
            counts.masked ? "of those without mask" : "confirmed by other views",
        ],
        [
            "Points",
            number(totals.points ?? (data.cloud.source === "fused" ? data.cloud.of : NaN)),
            "in the fused cloud",
        ],
        [
            "Time",
            seconds(totals.wall_seconds),
            Number.isFinite(totals.cpu_seconds) ? `${seconds(totals.cpu_seconds)} of CPU` : "not measured",
        ],
        ["Peak memory", bytes(totals.peak_resident_bytes), null],
        ["Warnings", number(data.advice.length), data.advice.length ? "see below" : "none"],
    ].filter(([, value]) => value !== "unknown");
    const tile = ([name, value, more]) =>
        element(
            "div",
            { class: "tile" },
            element("dt", {}, name),
            element("dd", {}, value, more ? element("span", { class: "more" }, more) : null),
        );
    document.getElementById("main").append(element("dl", { class: "tiles" }, ...tiles.map(tile)));
}

// That the run is not complete, and how to see more.
function badge() {
    const made = document.getElementById("badge");
    made.hidden = false;
    made.textContent = `${data.finished} of ${views.length} views finished`;
    const again = location.protocol.startsWith("http")
        ? "Load the page again to see what is done since."
        : "`skep view RUN --fresh` makes the page again.";
    const text =
        `This run is not complete: it goes on, or it was interrupted. The page shows what is ` +
        `done so far. ${again}`;
    document.getElementById("main").append(element("p", { class: "notice", id: "unfinished" }, text));
}

export function advice() {
    if (data.advice.length === 0) return;
    const entry = ({ what, remedy, views: numbers, count: all }) => {
        const names = numbers.flatMap((view, index) => [
            index ? ", " : ": ",
            element(
                "button",
                { class: "link", type: "button", onclick: () => openView(view) },
                views[view].name,
            ),
        ]);
        const more = all > numbers.length ? ` and ${all - numbers.length} more` : "";
        return element(
            "li",
            {},
            element("strong", {}, what),
            ...names,
            more,
            remedy ? element("span", { class: "remedy" }, remedy) : null,
        );
    };
    section(
        "warnings",
        "Warnings",
        "What may be wrong with this reconstruction, and what to do about it.",
        element("ul", { class: "advice" }, ...data.advice.map(entry)),
    );
}
