// Elements and numbers as texts. Names come from files: they only ever become text nodes and attributes.

const SVG = "http://www.w3.org/2000/svg";

export function element(tag, attributes = {}, ...children) {
    return fill(document.createElement(tag), attributes, children);
}

export function shape(tag, attributes = {}, ...children) {
    return fill(document.createElementNS(SVG, tag), attributes, children);
}

function fill(made, attributes, children) {
    for (const [name, value] of Object.entries(attributes)) {
        if (value === undefined || value === null || value === false) continue;
        if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
        else if (name === "style") Object.assign(made.style, value);
        else made.setAttribute(name, value === true ? "" : value);
    }
    made.append(...children.filter((child) => child !== null && child !== undefined && child !== false));
    return made;
}

// A section of the page, which the navigation lists.
export function section(id, title, lead, ...children) {
    const heading = element("h2", { id: `${id}-title` }, title);
    const text = lead ? element("p", { class: "lead" }, lead) : null;
    const made = element("section", { id, "aria-labelledby": `${id}-title` }, heading, text, ...children);
    document.getElementById("main").append(made);
    const link = element("a", { href: `#${id}` }, title);
    document.getElementById("sections").append(element("li", {}, link));
    return made;
}

// A number with four significant digits, without needless zeros; a minus sign that screen readers read.
export function number(value, digits = 4) {
    if (value === null || value === undefined || !Number.isFinite(value)) return "unknown";
    if (Number.isInteger(value)) return value.toLocaleString("en-US");
    const rounded = Number(value.toPrecision(digits));
    const size = Math.abs(rounded);
    if (size >= 1e6 || size < 1e-4) return rounded.toExponential();
    return rounded.toLocaleString("en-US", { maximumSignificantDigits: digits });
}

export function percent(share) {
    return Number.isFinite(share) ? `${(100 * share).toFixed(1)} %` : "unknown";
}

export function seconds(value) {
    if (!Number.isFinite(value)) return "unknown";
    if (value < 100) return `${value.toFixed(1)} s`;
    if (value < 6000) return `${(value / 60).toFixed(1)} min`;
    return `${(value / 3600).toFixed(1)} h`;
}

export function bytes(value) {
    if (!Number.isFinite(value)) return "unknown";
    return value < 1e9 ? `${(value / 1e6).toFixed(0)} MB` : `${(value / 1e9).toFixed(1)} GB`;
}

export const count = (number, one, many = `${one}s`) =>
    `${number.toLocaleString("en-US")} ${number === 1 ? one : many}`;
