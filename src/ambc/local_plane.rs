//! The plane that the depths around a pixel lie on, beyond the paper: matching tells depths more sharply than normals, so
//! the depths of many neighbors tell the normal.

use super::colony::Colonies;
use super::food_source::FoodSource;
use super::onlooker::OFFSETS;
use crate::geometry::SlantedPlane;
use crate::matching::Problem;
use glam::{Mat2, Vec2};

/// Neighbors it takes.
const MIN_NEIGHBORS: u32 = 6;
/// The spread of their places, as the determinant of its matrix in pixels, below which they lie on a line.
const MIN_SPREAD: f32 = 1.0;

/// The plane of least squares in inverse depth through those neighbors whose depths continue the plane of a food source
/// of this pixel, up to a relative `tolerance`; `None` where they are too few.
#[inline(always)]
pub fn fitted(
    problem: &Problem,
    neighbors: &Colonies,
    (x, y): (usize, usize),
    food: &FoodSource,
    tolerance: f32,
) -> Option<FoodSource> {
    let ray = problem.ray(x as f32, y as f32);
    let plane = food.plane(problem, ray);
    let (mut count, mut places, mut squares) = (0, Vec2::ZERO, Mat2::ZERO);
    // How much larger the neighbors' inverse depths are than the plane has it, and that times their places.
    let (mut rests, mut moments) = (0.0, Vec2::ZERO);
    for (dx, dy) in OFFSETS {
        let (nx, ny) = (x.wrapping_add_signed(dx as isize), y.wrapping_add_signed(dy as isize));
        if nx >= neighbors.width || ny >= neighbors.height {
            continue;
        }
        let depth = neighbors.best(nx, ny).depth;
        let place = Vec2::new(dx as f32, dy as f32);
        let expected = plane.inverse_depth_at(place.x, place.y);
        let rest = 1.0 / depth - expected;
        if depth > 0.0 && rest.abs() < tolerance * expected {
            count += 1;
            places += place;
            squares += Mat2::from_cols(place.x * place, place.y * place);
            rests += rest;
            moments += rest * place;
        }
    }
    if count < MIN_NEIGHBORS {
        return None;
    }
    let (middle, rest) = (places / count as f32, rests / count as f32);
    let spread = squares - Mat2::from_cols(middle.x * places, middle.y * places);
    if spread.determinant() < MIN_SPREAD {
        return None;
    }
    let slope = spread.inverse() * (moments - rest * places);
    let fit = SlantedPlane {
        inverse_depth: plane.inverse_depth + rest - slope.dot(middle),
        slope_x: plane.slope_x + slope.x,
        slope_y: plane.slope_y + slope.y,
    };
    let found = FoodSource::of_plane(problem, ray, &fit)?;
    Some(FoodSource { validated: food.validated, ..found })
}
