// Tests of the report of a run: `report.mjs SKEP RUN SCRATCH`.

import { strict as assert } from "node:assert";
import { spawn, spawnSync } from "node:child_process";
import { createRequire } from "node:module";
import {
    cpSync,
    mkdirSync,
    readFileSync,
    readdirSync,
    renameSync,
    rmSync,
    statSync,
    writeFileSync,
} from "node:fs";
import { join } from "node:path";
import { difference, pixels, settled, withPage } from "./browser.mjs";
import { readMap } from "./maps.mjs";

const [, , skep, run, scratch] = process.argv;
const file = join(run, "report.html");
const url = `file://${file}`;
const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const screenshots = process.env.SKEP_SCREENSHOTS;
const CLOUD = "#cloud-canvas";
const MODES = ["photograph", "normal", "height", "views", "confidence"];
const LAYERS = ["photograph", "depth", "normal", "sources", "confidence", "status"];

// What a browser without WebGL does.
const WITHOUT_WEBGL = `{
  const { getContext } = HTMLCanvasElement.prototype;
  HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
    return kind.startsWith("webgl") ? null : getContext.call(this, kind, ...rest);
  };
}`;

const still = { reducedMotion: "reduce" };
const tests = {};

async function picture(page, name, options = {}) {
    if (!screenshots) return;
    mkdirSync(screenshots, { recursive: true });
    await page.screenshot({ path: join(screenshots, `${name}.png`), ...options });
}

tests["the page is one file of less than 25 MB that names no other"] = async () => {
    const text = readFileSync(file, "utf8");
    assert.ok(statSync(file).size < 25e6, `${statSync(file).size} bytes`);
    assert.ok(
        !/(?:src|href)\s*=\s*["']?(?:https?:)?\/\//i.test(text.replace(/<script>.*/s, "")),
        "a reference",
    );
};

tests["the cloud draws, in every color, and turns by mouse and keys"] = () =>
    withPage(scratch, url, still, async (page) => {
        await page.locator(CLOUD).scrollIntoViewIfNeeded();
        await settled(page);
        const background = await page.evaluate(() =>
            getComputedStyle(document.querySelector(".stage")).backgroundColor.match(/\d+/g).map(Number),
        );
        const first = await pixels(page, CLOUD);
        const plain = first.map((_, index) => (index % 4 === 3 ? 255 : background[index % 4]));
        assert.ok(difference(first, plain) > 0.05, "the canvas has little but its background");

        let before = first;
        for (const mode of [...MODES.slice(1), MODES[0]]) {
            await page.locator(`[name=color][value=${mode}]`).check({ force: true });
            await settled(page);
            const now = await pixels(page, CLOUD);
            assert.ok(difference(before, now) > 0.02, `the color by ${mode} changes the picture`);
            const legend = await page.locator("#cloud-legend").innerText();
            assert.match(
                legend,
                /units of the model|number|probability|direction|color/,
                `the legend of ${mode} has a unit: ${legend}`,
            );
            await picture(page, `cloud-${mode}`);
            before = now;
        }

        const box = await page.locator(CLOUD).boundingBox();
        await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
        await page.mouse.down();
        await page.mouse.move(box.x + box.width / 2 + 120, box.y + box.height / 2 + 20, { steps: 5 });
        await page.mouse.up();
        await settled(page);
        const turned = await pixels(page, CLOUD);
        assert.ok(difference(before, turned) > 0.02, "dragging turns the cloud");
        before = turned;
        for (const key of ["ArrowLeft", "ArrowUp", "+", "-", "Shift+ArrowRight", "Home"]) {
            for (let press = 0; press < 3; press++) await page.locator(CLOUD).press(key);
            await settled(page);
            const now = await pixels(page, CLOUD);
            assert.ok(difference(before, now) > 0.01, `the key ${key} changes the picture`);
            before = now;
        }
        await page.locator("#point-size").fill("2");
        await settled(page);
        const large = await pixels(page, CLOUD);
        assert.ok(difference(before, large) > 0.01, "the size of the points changes the picture");
        await page.locator("#cameras").uncheck();
        await settled(page);
        assert.ok(difference(large, await pixels(page, CLOUD)) > 0.002, "the cameras can be hidden");
    });

tests["the cloud turns by itself unless motion is unwelcome, and stops by its button"] = async () => {
    const isTurning = async (page) => {
        await page.locator(CLOUD).scrollIntoViewIfNeeded();
        await settled(page);
        const before = await pixels(page, CLOUD);
        await page.waitForTimeout(2500);
        return difference(before, await pixels(page, CLOUD)) > 0.005;
    };
    await withPage(scratch, url, { reducedMotion: "no-preference" }, async (page) => {
        assert.ok(await isTurning(page));
        await page.locator("#turn").click();
        await page.waitForTimeout(600);
        assert.ok(!(await isTurning(page)), "the button stops it");
    });
    await withPage(scratch, url, still, async (page) =>
        assert.ok(!(await isTurning(page)), "it stays still"),
    );
};

tests["touch turns the cloud"] = () =>
    withPage(
        scratch,
        url,
        { ...still, hasTouch: true, viewport: { width: 390, height: 844 } },
        async (page) => {
            await page.locator(CLOUD).scrollIntoViewIfNeeded();
            await settled(page);
            const before = await pixels(page, CLOUD);
            const box = await page.locator(CLOUD).boundingBox();
            const session = await page.context().newCDPSession(page);
            const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
            const send = (type, touchPoints) =>
                session.send("Input.dispatchTouchEvent", { type, touchPoints });
            await send("touchStart", [{ x, y }]);
            for (let step = 1; step <= 5; step++) await send("touchMove", [{ x: x + 20 * step, y }]);
            await send("touchEnd", []);
            await settled(page);
            assert.ok(difference(before, await pixels(page, CLOUD)) > 0.02);
        },
    );

tests["points under the cursor have values that lie in the cloud"] = () =>
    withPage(scratch, url, still, async (page) => {
        await page.locator(CLOUD).scrollIntoViewIfNeeded();
        await settled(page);
        const { min, size } = await page.evaluate(
            () => JSON.parse(document.getElementById("data").textContent).cloud,
        );
        const box = await page.locator(CLOUD).boundingBox();
        let found = null;
        for (let step = 0; step < 60 && !found; step++) {
            await page.mouse.move(box.x + box.width * (0.35 + 0.005 * step), box.y + box.height * 0.5);
            await settled(page);
            found = /^Point \((.*?)\), seen by (\d+) views?, confidence ([\d.]+), height/.exec(
                await page.locator("#cloud-value").innerText(),
            );
        }
        assert.ok(found, "a point under the cursor");
        const place = found[1].split(", ").map((text) => Number(text.replace("\u2212", "-")));
        place.forEach((value, axis) => {
            const slack = Math.abs(value) * 1e-3 + 1e-6;
            assert.ok(value >= min[axis] - slack && value <= min[axis] + size[axis] + slack, found[0]);
        });
        assert.ok(Number(found[2]) >= 1 && Number(found[3]) <= 1, found[0]);
    });

// Places the slider of the gallery at a layer.
async function showLayer(page, layer) {
    await page.locator("#layer").fill(String(LAYERS.indexOf(layer)));
    await page.waitForFunction(
        (layer) => document.querySelector(".view canvas").dataset.shown === `0 ${layer}`,
        layer,
    );
}

tests["the slider shows every layer of every view, with a legend in units"] = () =>
    withPage(scratch, url, still, async (page) => {
        await page.locator("#views").scrollIntoViewIfNeeded();
        const units = {
            photograph: /0 to 255/,
            depth: /units of the model/,
            normal: /direction/,
            sources: /number/,
            confidence: /0 to 1/,
            status: /of each pixel/,
        };
        const seen = [];
        for (const layer of LAYERS) {
            await showLayer(page, layer);
            const now = await pixels(page, ".view canvas");
            for (const other of seen)
                assert.ok(difference(other, now) > 0.05, `${layer} differs from the others`);
            seen.push(now);
            assert.match(await page.locator("#layer-legend").innerText(), units[layer]);
            assert.match(
                await page.locator("#layer-note").innerText(),
                /stored|reduced/i,
                "the quantisation is stated",
            );
            assert.doesNotMatch(await page.locator("#layer-note").innerText(), /Missing/);
        }
        await showLayer(page, "photograph");
        await page.locator("#layer").press("ArrowRight");
        await page.waitForFunction(() => document.querySelector(".view canvas").dataset.shown === "0 depth");
    });

tests["values under the cursor are those of the maps, within their quantisation"] = () =>
    withPage(scratch, url, still, async (page) => {
        const { name } = await page.evaluate(
            () => JSON.parse(document.getElementById("data").textContent).views[0],
        );
        const range = await page.evaluate(
            () => JSON.parse(document.getElementById("data").textContent).views[0].depth,
        );
        const depth = readMap(run, "depth", name);
        const normal = readMap(run, "normal", name);
        const confidence = readMap(run, "confidence", name);
        const canvas = page.locator(".view canvas").first();
        await canvas.scrollIntoViewIfNeeded();
        // With half of the last digit that is shown.
        const error = Math.log(range[1] / range[0]) / 254 / 2 + 6e-4;
        let compared = 0;
        for (let step = 0; step < 24; step++) {
            const at = [0.08 + 0.037 * step, 0.2 + (0.6 * ((step * 7) % 24)) / 24];
            const read = async (layer, pattern) => {
                await showLayer(page, layer);
                const box = await canvas.boundingBox();
                await page.mouse.move(box.x + box.width * at[0] + 3, box.y + box.height * at[1]);
                await page.mouse.move(box.x + box.width * at[0], box.y + box.height * at[1]);
                const value = page.locator("#layer-value");
                await page.waitForFunction(() =>
                    /pixel \d+, \d+:/.test(document.getElementById("layer-value").textContent),
                );
                await settled(page);
                const text = await value.innerText();
                const [, x, y] = /pixel (\d+), (\d+):/.exec(text).map(Number);
                return { text, x, y, found: pattern.exec(text) };
            };
            const { text, x, y, found } = await read("depth", /: depth ([\d.,e-]+)/);
            const truth = depth.at(x, y);
            assert.equal(found !== null, truth > 0, `${text}; the map has ${truth}`);
            if (!found) continue;
            if (truth > range[0] && truth < range[1]) {
                assert.ok(
                    Math.abs(Math.log(Number(found[1].replace(",", "")) / truth)) < error,
                    `${text}; the map has ${truth}`,
                );
            }
            if (compared++ > 3) continue;
            const sure = await read("confidence", /: confidence ([\d.]+)/);
            assert.ok(
                Math.abs(Number(sure.found[1]) - confidence.at(sure.x, sure.y)) <= 0.0101,
                `${sure.text}; the map has ${confidence.at(sure.x, sure.y)}`,
            );
            const facing = await read("normal", /: normal \((.*?)\)/);
            facing.found[1].split(", ").forEach((component, axis) => {
                const own = Number(component.replace("\u2212", "-"));
                assert.ok(
                    Math.abs(own - normal.at(facing.x, facing.y, axis)) < 0.022,
                    `${facing.text}; the map has ${normal.at(facing.x, facing.y, axis)} at ${axis}`,
                );
            });
        }
        assert.ok(compared >= 5, `${compared} places with depths`);
    });

tests["a view opens large, by keyboard too, and keys move its cross"] = () =>
    withPage(scratch, url, still, async (page) => {
        await showLayer(page, "status");
        await page.locator(".view").first().focus();
        await page.keyboard.press("Enter");
        const dialog = page.locator("#view-dialog");
        assert.ok(await dialog.isVisible());
        await page.waitForFunction(() => document.getElementById("view-canvas").dataset.shown === "0 status");
        const value = () => page.locator("#view-value").innerText();
        await page.locator("#view-canvas").focus();
        await page.keyboard.press("ArrowRight");
        await settled(page);
        const first = await value();
        await page.keyboard.press("Shift+ArrowDown");
        await settled(page);
        assert.notEqual(await value(), first);
        await picture(page, "view");
        await page.locator("#view-dialog").getByLabel("Next view").click();
        await page.waitForFunction(() => document.getElementById("view-canvas").dataset.shown === "1 status");
        await page.keyboard.press("Escape");
        assert.ok(!(await dialog.isVisible()));
    });

tests["the table sorts, and charts and map are there"] = () =>
    withPage(scratch, url, still, async (page) => {
        const shares = () => page.locator("#figures tbody tr td:nth-child(3)").allInnerTexts();
        await page.locator("#figures thead").getByRole("button", { name: "Validated" }).click();
        const sorted = (await shares()).map(parseFloat);
        assert.deepEqual(
            sorted,
            sorted.toSorted((a, b) => a - b),
        );
        for (const name of [/^Convergence/, /^Camera map/, /^Triangulation angles/]) {
            assert.ok(await page.getByRole("img", { name }).isVisible(), String(name));
        }
        assert.match(await page.locator("#course").innerText(), /Search\s+[\d.]+ s/);
    });

tests["the cycles of --dump are shown, where there are some"] = () =>
    withPage(scratch, url, still, async (page) => {
        if ((await page.locator("#cycles").count()) === 0) return;
        await page.locator("#cycles").scrollIntoViewIfNeeded();
        const source = () => page.locator("#cycles img").first().getAttribute("src");
        const last = await source();
        await page.locator("#cycle").fill("0");
        assert.notEqual(await source(), last);
        const size = await page
            .locator("#cycles img")
            .first()
            .evaluate((image) => image.decode().then(() => image.naturalWidth));
        assert.ok(size >= 100, `${size} pixels`);
    });

for (const [name, options] of Object.entries({
    desktop: { colorScheme: "light" },
    dark: { colorScheme: "dark" },
    phone: { colorScheme: "light", viewport: { width: 360, height: 740 } },
    "phone-dark": { colorScheme: "dark", viewport: { width: 360, height: 740 } },
})) {
    tests[`${name}: nothing for an accessibility checker to complain of, no sideways scrolling`] = () =>
        withPage(scratch, url, { ...still, ...options }, async (page) => {
            await settled(page);
            const width = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
            assert.ok(width[0] <= width[1], `${width[0]} of ${width[1]} pixels`);
            await page.evaluate(axe);
            const check = async (what) => {
                const { violations } = await page.evaluate(() => globalThis.axe.run());
                const found = violations.map(
                    ({ id, impact, nodes }) =>
                        `${impact} ${id}: ${nodes.map(({ html }) => html.slice(0, 120)).join(" | ")}`,
                );
                assert.deepEqual(found, [], what);
            };
            await check("the page");
            await picture(page, name);
            await page.locator("#views").scrollIntoViewIfNeeded();
            await showLayer(page, "depth");
            await page.evaluate(() => document.getElementById("views").scrollIntoView());
            await settled(page);
            await picture(page, `${name}-views`);
            await page.evaluate(() => document.getElementById("course").scrollIntoView());
            await picture(page, `${name}-course`);
            await page.locator(".view").first().click();
            await settled(page);
            await check("an open view");
            await picture(page, `${name}-open`);
        });
}

tests["without WebGL the page says so, and all else works"] = () =>
    withPage(scratch, url, { ...still, script: WITHOUT_WEBGL }, async (page) => {
        assert.match(await page.locator("#no-webgl").innerText(), /no WebGL/);
        await showLayer(page, "depth");
    });

tests["names of views are text, whatever they are"] = async () => {
    const folder = join(scratch, "hostile");
    rmSync(folder, { recursive: true, force: true });
    cpSync(run, folder, { recursive: true });
    const hostile = "<img src=x onerror=alert(1)><\u2028script>alert(2)<!--.jpg";
    const { name } = JSON.parse(readFileSync(join(run, "report.json"))).views[0];
    const rename = (directory, before, after) => {
        for (const entry of readdirSync(directory, { withFileTypes: true })) {
            const path = join(directory, entry.name);
            if (entry.isDirectory()) rename(path, before, after);
            else if (entry.name.startsWith(before))
                renameSync(path, join(directory, after + entry.name.slice(before.length)));
        }
    };
    // A space would end a name in the model's text.
    const written = hostile.replaceAll(" ", "_").replaceAll("\u2028", "");
    for (const part of ["images", "stereo", "preview"]) rename(join(folder, part), name, written);
    for (const path of [join(folder, "report.json"), join(folder, "sparse", "images.txt")]) {
        writeFileSync(path, readFileSync(path, "utf8").replaceAll(name, written));
    }
    const text = readFileSync(join(folder, "report.json"), "utf8");
    writeFileSync(
        join(folder, "report.json"),
        text.replace(
            '"warnings": []',
            `"warnings": [${JSON.stringify(hostile + "</script><script>alert(3)</script>")}]`,
        ),
    );
    const made = spawnSync(skep, ["view", "--fresh", folder], {
        encoding: "utf8",
        env: { ...process.env, PATH: "" },
    });
    assert.equal(made.status, 0, made.stderr);
    await withPage(scratch, `file://${join(folder, "report.html")}`, still, async (page) => {
        assert.equal(await page.locator(".view .caption span").first().getAttribute("title"), written);
        await page.locator(".view").first().click();
        await settled(page);
        assert.equal(await page.locator("#view-name").innerText(), written);
        assert.match(await page.locator("#warnings").innerText(), /alert\(3\)/, "shown as text");
        assert.equal(await page.locator("img[src=x]").count(), 0);
    });
};

tests["the page is served to this machine"] = async () => {
    const server = spawn(skep, ["view", run, "--serve", "0"], { stdio: ["ignore", "pipe", "inherit"] });
    try {
        const address = await new Promise((done, fail) => {
            server.stdout.once("data", (bytes) => done(String(bytes).trim()));
            server.once("exit", () => fail(new Error("the server ended")));
        });
        assert.match(address, /^http:\/\/127\.0\.0\.1:\d+\/$/);
        await withPage(scratch, address, still, async (page) => {
            assert.ok(await page.locator(CLOUD).isVisible());
        });
    } finally {
        server.kill("SIGINT");
    }
};

const wanted = process.env.SKEP_TEST ?? "";
let failed = 0;
for (const [name, test] of Object.entries(tests)) {
    if (!name.includes(wanted)) continue;
    const started = Date.now();
    try {
        await test();
        console.log(`passed in ${((Date.now() - started) / 1000).toFixed(1)} s: ${name}`);
    } catch (error) {
        failed += 1;
        console.error(`FAILED: ${name}\n${error.stack ?? error}`);
    }
}
if (failed) process.exit(1);
console.log("browser: all passed");
