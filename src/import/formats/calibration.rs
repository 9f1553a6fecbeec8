//! Calibration matrices of pinhole cameras.

/// What a matrix must be, for error texts.
pub(super) const CALIBRATION: &str = "f 0 x, 0 f y, 0 0 1 (skew up to 0.05 pixels)";
/// Pixels of shear for a ray at 45 degrees that is taken for rounding.
const MAX_SKEW: f64 = 0.05;

/// fx, fy, cx, cy of a matrix, row by row, whose unit is this many pixels; `None` for another matrix.
pub(super) fn pinhole(matrix: [f64; 9], unit: f64) -> Option<[f64; 4]> {
    let [fx, skew, cx, k21, fy, cy, k31, k32, k33] = matrix;
    let is_pinhole = [k21, k31, k32] == [0.0; 3] && k33 == 1.0 && (skew * unit).abs() <= MAX_SKEW;
    is_pinhole.then_some([fx, fy, cx, cy])
}
