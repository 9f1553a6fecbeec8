// Vectors of three numbers.

export const add = (a, b) => a.map((value, axis) => value + b[axis]);
export const subtract = (a, b) => a.map((value, axis) => value - b[axis]);
export const scale = (a, factor) => a.map((value) => value * factor);
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
export const length = (a) => Math.hypot(...a);
export const normalize = (a) => scale(a, 1 / (length(a) || 1));
export const mean = (all) => scale(all.reduce(add, [0, 0, 0]), 1 / (all.length || 1));

// Directions to the right and up in a plane that is seen from above; `up` points to the eye, `ahead` up.
export function groundPlane(up, ahead) {
    let right = cross(ahead, up);
    if (length(right) < 1e-3) right = cross(Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], up);
    right = normalize(right);
    return [right, cross(up, right)];
}
