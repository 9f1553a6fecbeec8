// The pictures of every cycle, where the run wrote them with --dump.

import { blob, data, views } from "./data.js";
import { element, section } from "./dom.js";

const TITLES = {
    depth: "Depth of every pixel",
    normal: "Normal of every pixel",
    validated: "White: validated",
};

export function cycles() {
    const dump = data.dump;
    if (!dump || dump.cycles.length === 0) return;
    const choice = element(
        "select",
        { id: "cycle-view" },
        ...dump.views.map((view) => element("option", { value: view }, views[view].name)),
    );
    const slider = element("input", {
        type: "range",
        id: "cycle",
        min: 0,
        max: dump.cycles.length - 1,
        step: 1,
        value: dump.cycles.length - 1,
    });
    const label = element("output", { for: "cycle" });
    const figures = element("div", { class: "cycle" });
    const urls = new Map();
    const url = (name) => {
        const bytes = urls.has(name) ? null : blob(name);
        if (bytes) urls.set(name, URL.createObjectURL(new Blob([bytes], { type: "image/jpeg" })));
        return urls.get(name);
    };
    const show = () => {
        label.textContent = dump.cycles[slider.value];
        slider.setAttribute("aria-valuetext", dump.cycles[slider.value]);
        figures.replaceChildren(
            ...dump.kinds.map((kind) => {
                const source = url(`cycle-${slider.value}-${choice.value}-${kind}`);
                const title = TITLES[kind] ?? kind;
                const alt = `${title}, ${views[choice.value].name}, ${dump.cycles[slider.value]}`;
                return element(
                    "figure",
                    {},
                    source ? element("img", { src: source, alt }) : element("p", {}, "no picture"),
                    element("figcaption", { class: "quiet" }, title),
                );
            }),
        );
    };
    slider.addEventListener("input", show);
    choice.addEventListener("change", show);
    section(
        "cycles",
        "Seeing inside",
        "The estimate after every cycle of the search, from coarse to fine: how depths form, and where " +
            "they stay wrong.",
        element(
            "div",
            { class: "controls" },
            element("label", {}, "View", choice),
            element("label", {}, "Cycle", slider),
            label,
        ),
        figures,
    );
    show();
}
