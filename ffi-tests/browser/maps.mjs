// Maps of a run, as COLMAP lays them out.

import { readFileSync } from "node:fs";
import { join } from "node:path";

// Width, height and a function that gives the value at a pixel.
export function readMap(run, what, name) {
    const bytes = readFileSync(join(run, "stereo", `${what}_maps`, `${name}.geometric.bin`));
    const [, width, height, channels] = /^(\d+)&(\d+)&(\d+)&/
        .exec(bytes.subarray(0, 40).toString("latin1"))
        .map(Number);
    const start = `${width}&${height}&${channels}&`.length;
    const at = (x, y, channel = 0) => bytes.readFloatLE(start + 4 * ((channel * height + y) * width + x));
    return { width, height, at };
}
