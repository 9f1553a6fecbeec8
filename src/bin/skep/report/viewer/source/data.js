// What the file holds: figures, and pictures and points in base64.

export const data = JSON.parse(document.getElementById("data").textContent);
export const report = data.report ?? {};
export const views = data.views;

// Bytes of an element of the file; null where there is none.
export function blob(name) {
    const found = document.getElementById(name);
    if (!found) return null;
    const text = atob(found.textContent);
    const bytes = new Uint8Array(text.length);
    for (let index = 0; index < text.length; index++) bytes[index] = text.charCodeAt(index);
    return bytes;
}

export const hasBlob = (name) => document.getElementById(name) !== null;

// The entry of report.json for a view.
const reports = new Map((report.views ?? []).map((entry) => [entry.name, entry]));
export const viewReport = (view) => reports.get(views[view].name) ?? {};

// Fraction of the unmasked pixels of a view that is validated.
export function validatedShare(view) {
    const { status_counts: counts } = viewReport(view);
    if (!counts) return NaN;
    const all = Object.values(counts).reduce((sum, value) => sum + value, 0) - counts.masked;
    return all > 0 ? counts.validated / all : 0;
}

// Decoded pictures, the last ones.
const decoded = new Map();
const MOST_DECODED = 48;

// The pixels of a picture, RGBA; null where there is none.
export async function picture(name, type) {
    if (decoded.has(name)) return decoded.get(name);
    const bytes = blob(name);
    if (!bytes) return null;
    const options = { colorSpaceConversion: "none", premultiplyAlpha: "none" };
    const bitmap = await createImageBitmap(new Blob([bytes], { type }), options);
    const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
    const context = canvas.getContext("2d", { willReadFrequently: true });
    context.drawImage(bitmap, 0, 0);
    const pixels = context.getImageData(0, 0, bitmap.width, bitmap.height);
    bitmap.close();
    decoded.set(name, pixels);
    if (decoded.size > MOST_DECODED) decoded.delete(decoded.keys().next().value);
    return pixels;
}
