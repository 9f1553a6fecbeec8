// The options of the run.

import { report } from "./data.js";
import { element, section } from "./dom.js";

export function options() {
    const entries = Object.entries(report.options ?? {});
    if (entries.length === 0) return;
    const row = ([name, value]) =>
        element("tr", {}, element("td", {}, name), element("td", { class: "value" }, String(value)));
    const table = element(
        "table",
        {},
        element(
            "thead",
            {},
            element(
                "tr",
                {},
                element("th", { scope: "col" }, "Option"),
                element("th", { scope: "col" }, "Value"),
            ),
        ),
        element("tbody", {}, ...entries.map(row)),
    );
    section(
        "options",
        "Options",
        "What skep info NAME explains, with the values of this run.",
        element(
            "details",
            {},
            element("summary", {}, `${entries.length} options of this run`),
            element(
                "div",
                { class: "scroll", tabindex: "0", role: "region", "aria-label": "Table of the options" },
                table,
            ),
        ),
    );
}
