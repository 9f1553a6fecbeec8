// The figures of each view, in a table that can be sorted.

import { validatedShare, viewReport, views } from "./data.js";
import { element, number, percent, section } from "./dom.js";
import { STATUSES, keyLegend, statusBar } from "./colors.js";
import { openView } from "./dialog.js";
import { rangeOf } from "./layers.js";

const residual = (view) => viewReport(view).cycles?.at(-1)?.median_residual ?? NaN;
const work = (view) => viewReport(view).ncc_evaluations / viewReport(view).pixels;
const unknown = (text) => (text === "unknown" ? "\u2013" : text);

// Title, explanation, value to sort by, and text.
const COLUMNS = [
    { title: "Validated", value: validatedShare, text: (view) => percent(validatedShare(view)) },
    {
        title: "Sources",
        about: "other views that it is matched with",
        value: (view) => views[view].sources.length,
    },
    {
        title: "Angle",
        about: "median angle between its rays and those of its sources",
        value: (view) => views[view].angle ?? NaN,
        text: (view) => (views[view].angle === null ? "unknown" : `${number(views[view].angle, 3)}\u00b0`),
    },
    {
        title: "Residual",
        about: "median distance between its planes and the depths of its sources, in pixels",
        value: residual,
        text: (view) => (Number.isFinite(residual(view)) ? `${number(residual(view), 2)} px` : "unknown"),
    },
    {
        title: "Depths searched",
        about: "in units of the model",
        value: (view) => viewReport(view).depth_min ?? NaN,
        text: rangeOf,
    },
    {
        title: "Sparse points",
        about: "points of the model that it sees",
        value: (view) => views[view].points,
    },
    {
        title: "NCC per pixel",
        about: "evaluations of the similarity for each pixel",
        value: work,
        text: (view) => number(work(view), 3),
    },
];

export function figures() {
    const known = COLUMNS.filter(({ value }) => views.some((_, view) => Number.isFinite(value(view))));
    const body = element("tbody");
    const rows = views.map((view, index) => {
        const { status_counts: counts } = viewReport(index);
        const name = element(
            "button",
            { class: "link", type: "button", onclick: () => openView(index) },
            view.name,
        );
        const cells = known.map(({ value, text }) =>
            element("td", {}, unknown(text ? text(index) : number(value(index)))),
        );
        return element(
            "tr",
            {},
            element("td", {}, name),
            element("td", {}, counts ? statusBar(counts) : "not finished"),
            ...cells,
        );
    });
    const heads = known.map(({ title, about, value }) => {
        const head = element(
            "th",
            { scope: "col", title: about },
            element("button", { type: "button", onclick: () => sort(head, value) }, title),
        );
        return head;
    });
    const sort = (head, value) => {
        const isDescending = head.getAttribute("aria-sort") === "ascending";
        for (const other of heads) other.removeAttribute("aria-sort");
        head.setAttribute("aria-sort", isDescending ? "descending" : "ascending");
        const order = views
            .map((_, view) => view)
            .sort((a, b) => {
                const [first, second] = [value(a), value(b)];
                if (Number.isNaN(first) || Number.isNaN(second))
                    return Number.isNaN(first) - Number.isNaN(second);
                return isDescending ? second - first : first - second;
            });
        body.append(...order.map((view) => rows[view]));
    };
    body.append(...rows);
    const table = element(
        "table",
        {},
        element(
            "thead",
            {},
            element(
                "tr",
                {},
                element("th", { scope: "col" }, "View"),
                element("th", { scope: "col" }, "Status of the pixels"),
                ...heads,
            ),
        ),
        body,
    );
    section(
        "figures",
        "Figures per view",
        null,
        keyLegend(
            "Status",
            "share of the pixels",
            STATUSES.map((status) => ({ ...status, label: `${status.label}: ${status.meaning}` })),
        ),
        element(
            "div",
            { class: "tall scroll", tabindex: "0", role: "region", "aria-label": "Table of the figures" },
            table,
        ),
    );
}
