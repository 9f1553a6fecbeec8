//! Lens distortion: from the ray of a pinhole camera to the place where a real lens shows it.

use glam::DVec2;

/// How a lens displaces the image of a ray. Coordinates are those of an ideal pinhole image at focal length
/// 1, `x / z` and `y / z`; the parameters are those of OpenCV and COLMAP.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Distortion {
    /// Radial as a quotient of polynomials in r^2, and tangential:
    /// `(1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6)`.
    Brown {
        /// k1 to k6.
        radial: [f64; 6],
        /// p1, p2.
        tangential: [f64; 2],
    },
    /// Equidistant: the distance from the center is the angle of the ray to the axis, then distorted by
    /// `1 + k1 a^2 + k2 a^4 + k3 a^6 + k4 a^8`, tangentially and by a thin prism.
    Fisheye {
        /// k1 to k4.
        radial: [f64; 4],
        /// p1, p2.
        tangential: [f64; 2],
        /// sx1, sy1.
        prism: [f64; 2],
    },
    /// The field-of-view model: `atan(2 r tan(w / 2)) / (r w)`.
    FieldOfView {
        /// w, in radians.
        omega: f64,
    },
}

/// Step of the numerical derivatives of a distortion.
const STEP: f64 = 1e-6;
/// Iterations of the inverse; ten are enough within the image of a usual lens.
const ITERATIONS: usize = 100;

impl Distortion {
    /// The radial distortion with these coefficients of r^2, r^4 and so on, and the tangential one.
    pub fn brown(radial: &[f64], tangential: [f64; 2]) -> Distortion {
        let mut all = [0.0; 6];
        all.iter_mut().zip(radial).for_each(|(own, &given)| *own = given);
        Distortion::Brown { radial: all, tangential }
    }

    /// The fisheye distortion with these radial coefficients only.
    pub fn fisheye(radial: &[f64]) -> Distortion {
        let mut all = [0.0; 4];
        all.iter_mut().zip(radial).for_each(|(own, &given)| *own = given);
        Distortion::Fisheye { radial: all, tangential: [0.0; 2], prism: [0.0; 2] }
    }

    /// Whether all parameters are finite.
    pub fn is_finite(&self) -> bool {
        match self {
            Distortion::Brown { radial, tangential } => {
                radial.iter().chain(tangential).all(|value| value.is_finite())
            }
            Distortion::Fisheye { radial, tangential, prism } => {
                radial.iter().chain(tangential).chain(prism).all(|value| value.is_finite())
            }
            Distortion::FieldOfView { omega } => omega.is_finite(),
        }
    }

    /// Where the lens shows an ideal point.
    pub fn distort(&self, ideal: DVec2) -> DVec2 {
        match *self {
            Distortion::Brown { radial: [k1, k2, k3, k4, k5, k6], tangential } => {
                let r2 = ideal.length_squared();
                let numerator = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
                let denominator = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
                ideal * (numerator / denominator) + tangential_shift(ideal, tangential)
            }
            Distortion::Fisheye { radial: [k1, k2, k3, k4], tangential, prism } => {
                let r = ideal.length();
                let angle = ideal * if r > 1e-9 { r.atan() / r } else { 1.0 };
                let a2 = angle.length_squared();
                let factor = 1.0 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4)));
                angle * factor + tangential_shift(angle, tangential) + DVec2::from(prism) * a2
            }
            Distortion::FieldOfView { omega } => {
                let r = ideal.length();
                let wide = 2.0 * (omega / 2.0).tan();
                let factor = match (omega.abs() < 1e-6, r < 1e-9) {
                    (true, _) => 1.0,
                    (false, true) => wide / omega,
                    (false, false) => (r * wide).atan() / (r * omega),
                };
                ideal * factor
            }
        }
    }

    /// The ideal point that the lens shows here, by Newton's method; `None` where the lens shows none, or the
    /// method finds none.
    pub fn undistort(&self, shown: DVec2) -> Option<DVec2> {
        let mut ideal = shown;
        for _ in 0..ITERATIONS {
            let error = self.distort(ideal) - shown;
            if error.length_squared() < 1e-24 {
                return Some(ideal);
            }
            let (along_x, along_y) = self.derivatives(ideal);
            let determinant = along_x.perp_dot(along_y);
            let step = DVec2::new(error.perp_dot(along_y), along_x.perp_dot(error)) / determinant;
            if !step.is_finite() {
                return None;
            }
            ideal -= step;
        }
        (self.distort(ideal).distance(shown) < 1e-9).then_some(ideal)
    }

    /// Whether the image around an ideal point is not mirrored or folded: beyond the rays that a calibration
    /// saw, polynomials may turn back.
    pub fn is_regular(&self, ideal: DVec2) -> bool {
        let (along_x, along_y) = self.derivatives(ideal);
        along_x.perp_dot(along_y) > 0.0
    }

    fn derivatives(&self, ideal: DVec2) -> (DVec2, DVec2) {
        let along = |step: DVec2| (self.distort(ideal + step) - self.distort(ideal - step)) / (2.0 * STEP);
        (along(DVec2::new(STEP, 0.0)), along(DVec2::new(0.0, STEP)))
    }
}

fn tangential_shift(point: DVec2, [p1, p2]: [f64; 2]) -> DVec2 {
    let (r2, product) = (point.length_squared(), 2.0 * point.x * point.y);
    DVec2::new(
        p1 * product + p2 * (r2 + 2.0 * point.x * point.x),
        p2 * product + p1 * (r2 + 2.0 * point.y * point.y),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lenses() -> [Distortion; 5] {
        [
            Distortion::brown(&[-0.12, 0.03], [0.0; 2]),
            Distortion::brown(&[0.1, -0.2, 0.05, 0.02, 0.01, -0.003], [1e-3, -2e-3]),
            Distortion::fisheye(&[0.02, -0.01, 0.003, -0.0004]),
            Distortion::Fisheye { radial: [0.01; 4], tangential: [1e-3, 5e-4], prism: [2e-3, -1e-3] },
            Distortion::FieldOfView { omega: 0.9 },
        ]
    }

    #[test]
    fn undistorting_finds_the_ideal_point_that_a_lens_shows() {
        for lens in lenses() {
            for (x, y) in [(0.0, 0.0), (0.3, 0.0), (-0.2, 0.4), (0.5, -0.45), (1e-12, 1e-12)] {
                let ideal = DVec2::new(x, y);
                let found = lens.undistort(lens.distort(ideal)).unwrap();
                assert!(found.distance(ideal) < 1e-9, "{lens:?}: {found} instead of {ideal}");
                assert!(lens.is_regular(ideal));
            }
        }
    }

    #[test]
    fn a_polynomial_that_turns_back_is_not_regular_there() {
        // x - 0.5 x^3 turns at x = 0.816 and shows no point beyond 0.544.
        let lens = Distortion::brown(&[-0.5], [0.0; 2]);
        assert!(lens.is_regular(DVec2::new(0.8, 0.0)) && !lens.is_regular(DVec2::new(0.83, 0.0)));
        assert_eq!(lens.undistort(DVec2::new(0.7, 0.0)), None);
    }

    #[test]
    fn an_equidistant_fisheye_shows_the_angle_of_the_ray() {
        let shown = Distortion::fisheye(&[]).distort(DVec2::new(1.0, 0.0));
        assert!(shown.distance(DVec2::new(std::f64::consts::FRAC_PI_4, 0.0)) < 1e-12);
    }
}
