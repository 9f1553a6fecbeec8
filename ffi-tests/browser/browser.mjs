// A headless browser, and what is asked of every page: no errors, and no request but for the page itself.

import { strict as assert } from "node:assert";
import { mkdtempSync } from "node:fs";
import { join } from "node:path";
import { chromium } from "playwright-core";

const ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
];
// What the software renderer says of reading its pictures, which only this test does.
const HARMLESS = /GPU stall due to ReadPixels/;

// Opens a page and gives it to `use`; then nothing may have gone wrong in it.
export async function withPage(scratch, url, options, use) {
    const profile = mkdtempSync(join(scratch, "profile-"));
    const context = await chromium.launchPersistentContext(profile, {
        executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
        headless: true,
        viewport: { width: 1280, height: 900 },
        ...options,
        args: ARGUMENTS,
    });
    try {
        if (options.script) await context.addInitScript(options.script);
        const page = await context.newPage();
        const problems = [];
        page.on("console", (message) => {
            if (["error", "warning"].includes(message.type()) && !HARMLESS.test(message.text()))
                problems.push(message.text());
        });
        page.on("pageerror", (error) => problems.push(error.message));
        page.on("dialog", (dialog) => {
            problems.push(`a dialog: ${dialog.message()}`);
            dialog.dismiss();
        });
        page.on("request", (request) => {
            if (request.url() !== url && !/^(blob|data):/.test(request.url()))
                problems.push(`a request of ${request.url()}`);
        });
        await page.goto(url);
        await page.waitForFunction(() => document.documentElement.dataset.ready === "true", null, {
            timeout: 120_000,
        });
        await use(page);
        assert.deepEqual(problems, [], "errors, warnings, dialogs or requests");
    } finally {
        await context.close();
    }
}

// Waits until two frames were drawn.
export const settled = (page) =>
    page.evaluate(
        () =>
            new Promise((done) =>
                requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 150))),
            ),
    );

// A small copy of a canvas: its pixels as numbers.
export const pixels = (page, selector) =>
    page.evaluate((selector) => {
        const source = document.querySelector(selector);
        const copy = new OffscreenCanvas(160, 90);
        const context = copy.getContext("2d");
        context.drawImage(source, 0, 0, 160, 90);
        return [...context.getImageData(0, 0, 160, 90).data];
    }, selector);

// The share of pixels that differ.
export function difference(a, b) {
    let count = 0;
    for (let index = 0; index < a.length; index += 4) {
        const sum = [0, 1, 2, 3].reduce(
            (sum, channel) => sum + Math.abs(a[index + channel] - b[index + channel]),
            0,
        );
        if (sum > 24) count += 1;
    }
    return count / (a.length / 4);
}
