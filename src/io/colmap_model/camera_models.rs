//! COLMAP's camera models: their names, numbers and parameters.

use super::records::Place;
use crate::error::Result;
use crate::geometry::Distortion;

/// A camera model and the number of its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct CameraModel {
    pub name: &'static str,
    pub parameters: usize,
}

/// In the order of their numbers in binary files.
const MODELS: [CameraModel; 11] = [
    model("SIMPLE_PINHOLE", 3),
    model("PINHOLE", 4),
    model("SIMPLE_RADIAL", 4),
    model("RADIAL", 5),
    model("OPENCV", 8),
    model("OPENCV_FISHEYE", 8),
    model("FULL_OPENCV", 12),
    model("FOV", 5),
    model("SIMPLE_RADIAL_FISHEYE", 4),
    model("RADIAL_FISHEYE", 5),
    model("THIN_PRISM_FISHEYE", 12),
];

/// The number of PINHOLE in binary files, the only model that is written.
pub(super) const PINHOLE_NUMBER: u32 = 1;

const fn model(name: &'static str, parameters: usize) -> CameraModel {
    CameraModel { name, parameters }
}

impl CameraModel {
    pub(super) fn by_name(name: &str, camera: u32, place: &Place) -> Result<CameraModel> {
        MODELS.into_iter().find(|model| model.name == name).ok_or_else(|| {
            let names = MODELS.map(|model| model.name).join(", ");
            place.error(format!("camera {camera} has the model {name}; expected one of {names}"))
        })
    }

    pub(super) fn by_number(number: u32, camera: u32, place: &Place) -> Result<CameraModel> {
        match MODELS.get(number as usize) {
            Some(model) => Ok(*model),
            None => CameraModel::by_name(&format!("number {number}"), camera, place),
        }
    }

    /// fx, fy, cx, cy and the distortion, from as many parameters as the model has. A distortion of zeros is
    /// none.
    pub(super) fn calibration(self, parameters: &[f64]) -> ([f64; 4], Option<Distortion>) {
        let has_one_focal_length = matches!(self.name, "SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL")
            || matches!(self.name, "SIMPLE_RADIAL_FISHEYE" | "RADIAL_FISHEYE");
        let (pinhole, rest) = match (has_one_focal_length, parameters) {
            (true, [f, cx, cy, rest @ ..]) => ([*f, *f, *cx, *cy], rest),
            (false, [fx, fy, cx, cy, rest @ ..]) => ([*fx, *fy, *cx, *cy], rest),
            _ => ([0.0; 4], &[][..]),
        };
        let is_straight = rest.iter().all(|&value| value == 0.0) && !self.name.ends_with("FISHEYE");
        let distortion = match (self.name, rest) {
            _ if is_straight => return (pinhole, None),
            ("OPENCV", &[k1, k2, p1, p2]) => Distortion::brown(&[k1, k2], [p1, p2]),
            ("FULL_OPENCV", &[k1, k2, p1, p2, k3, k4, k5, k6]) => {
                Distortion::brown(&[k1, k2, k3, k4, k5, k6], [p1, p2])
            }
            ("FOV", &[omega]) => Distortion::FieldOfView { omega },
            ("THIN_PRISM_FISHEYE", &[k1, k2, p1, p2, k3, k4, sx1, sy1]) => {
                Distortion::Fisheye { radial: [k1, k2, k3, k4], tangential: [p1, p2], prism: [sx1, sy1] }
            }
            (name, radial) if name.ends_with("FISHEYE") => Distortion::fisheye(radial),
            (_, radial) => Distortion::brown(radial, [0.0; 2]),
        };
        (pinhole, Some(distortion))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn calibration(name: &str, parameters: &[f64]) -> ([f64; 4], Option<Distortion>) {
        let model =
            CameraModel::by_name(name, 1, &Place { path: Path::new("cameras.txt"), line: None }).unwrap();
        assert_eq!(model.parameters, parameters.len());
        model.calibration(parameters)
    }

    #[test]
    fn the_parameters_are_those_of_colmap_in_its_order() {
        let brown = |radial: &[f64], tangential| Some(Distortion::brown(radial, tangential));
        assert_eq!(calibration("SIMPLE_PINHOLE", &[9.0, 4.0, 3.0]), ([9.0, 9.0, 4.0, 3.0], None));
        assert_eq!(calibration("RADIAL", &[9.0, 4.0, 3.0, 0.1, 0.2]).1, brown(&[0.1, 0.2], [0.0; 2]));
        assert_eq!(calibration("SIMPLE_RADIAL", &[9.0, 4.0, 3.0, 0.0]), ([9.0, 9.0, 4.0, 3.0], None));
        let (pinhole, opencv) = calibration("OPENCV", &[9.0, 8.0, 4.0, 3.0, 0.1, 0.2, 0.3, 0.4]);
        assert_eq!((pinhole, opencv), ([9.0, 8.0, 4.0, 3.0], brown(&[0.1, 0.2], [0.3, 0.4])));
        let full = [9.0, 8.0, 4.0, 3.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8];
        assert_eq!(calibration("FULL_OPENCV", &full).1, brown(&[0.1, 0.2, 0.5, 0.6, 0.7, 0.8], [0.3, 0.4]));
        // A fisheye without coefficients is no pinhole camera.
        let equidistant = Some(Distortion::fisheye(&[]));
        assert_eq!(calibration("SIMPLE_RADIAL_FISHEYE", &[9.0, 4.0, 3.0, 0.0]).1, equidistant);
        let fisheye = calibration("OPENCV_FISHEYE", &[9.0, 8.0, 4.0, 3.0, 0.1, 0.2, 0.3, 0.4]).1;
        assert_eq!(fisheye, Some(Distortion::fisheye(&[0.1, 0.2, 0.3, 0.4])));
    }
}
