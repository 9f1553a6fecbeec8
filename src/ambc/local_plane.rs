//! The plane fitted to the depths around a pixel, beyond the paper: matching determines depths more sharply
//! than normals, so the depths of many neighbors determine the normal.

use super::colony::Colonies;
use super::food_source::FoodSource;
use super::onlooker::OFFSETS;
use crate::geometry::{Position, SlantedPlane};
use crate::matching::Problem;
use glam::{Mat2, Vec2};

/// Neighbors a fit needs: twice its three unknowns.
const MIN_NEIGHBORS: u32 = 6;
/// Determinant of the scatter matrix of the neighbors' positions, in pixels^4, below which they lie on a
/// line.
const MIN_SCATTER: f32 = 1.0;

/// The least-squares plane in inverse depth through those neighbors whose depths continue the plane of a food
/// source of this pixel up to a relative `tolerance`; `None` where they are too few or the plane is not
/// usable.
#[inline(always)]
pub(super) fn fit(
    problem: &Problem,
    neighbors: &Colonies,
    at: Position,
    food: &FoodSource,
    tolerance: f32,
) -> Option<FoodSource> {
    let ray = problem.ray(at.0 as f32, at.1 as f32);
    let plane = food.plane(problem, ray);
    let (mut count, mut positions, mut squares) = (0, Vec2::ZERO, Mat2::ZERO);
    // Residuals of the neighbors' inverse depths against the plane, and residuals times positions.
    let (mut residuals, mut moments) = (0.0, Vec2::ZERO);
    for offset in OFFSETS {
        let Some(neighbor) = neighbors.grid.neighbor(at, offset) else { continue };
        let depth = neighbors.best(neighbor).depth;
        let position = Vec2::new(offset.0 as f32, offset.1 as f32);
        let expected = plane.inverse_depth_at(position.x, position.y);
        let residual = 1.0 / depth - expected;
        if depth > 0.0 && residual.abs() < tolerance * expected {
            count += 1;
            positions += position;
            squares += Mat2::from_cols(position.x * position, position.y * position);
            residuals += residual;
            moments += residual * position;
        }
    }
    if count < MIN_NEIGHBORS {
        return None;
    }
    let (middle, residual) = (positions / count as f32, residuals / count as f32);
    let scatter = squares - Mat2::from_cols(middle.x * positions, middle.y * positions);
    if scatter.determinant() < MIN_SCATTER {
        return None;
    }
    let slope = scatter.inverse() * (moments - residual * positions);
    let fit = SlantedPlane {
        inverse_depth: plane.inverse_depth + residual - slope.dot(middle),
        slope_x: plane.slope_x + slope.x,
        slope_y: plane.slope_y + slope.y,
    };
    let found = FoodSource::of_plane(problem, ray, &fit)?;
    Some(FoodSource { validated: food.validated, ..found })
}
