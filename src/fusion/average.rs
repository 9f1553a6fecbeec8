//! The average of the pixels of a point.

use glam::DVec3;

/// A pixel that is part of a point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Member {
    pub(super) view: u32,
    /// Place of the view in the group of the reference.
    pub(super) slot: usize,
    /// Index in its view's maps.
    pub(super) pixel: usize,
    /// Relative to the reference's center, in world axes: large world coordinates lose no digits.
    pub(super) position: DVec3,
    /// Unit, in world axes.
    pub(super) normal: DVec3,
    /// Weight in the average.
    pub(super) weight: f64,
}

/// Members farther from the median than this many median absolute deviations (two standard deviations of
/// Gaussian errors) are left out: a depth within the tolerance can still have a much larger error than the
/// others.
const MAX_DEVIATIONS: f64 = 3.0;

/// Color of points without a picture.
const GRAY: [u8; 3] = [128; 3];

/// Weighted means of position, normal (unit) and color over the members within [`MAX_DEVIATIONS`] of the
/// median; the first member is the pixel of the reference. `color` is `None` for members without a picture.
pub(super) fn average(
    members: &[Member],
    color: impl Fn(&Member) -> Option<DVec3>,
) -> (DVec3, DVec3, [u8; 3]) {
    let start = &members[0];
    // Along the normal only: across it, pixel centers differ from the point by up to half a pixel.
    let height = |member: &Member| (member.position - start.position).dot(start.normal);
    let middle = median(members.iter().map(height).collect());
    let deviation = |member: &Member| (height(member) - middle).abs();
    let limit = MAX_DEVIATIONS * median(members.iter().map(deviation).collect());

    let (mut offset, mut normal, mut weight) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    let mut colors = Vec::new();
    for member in members.iter().filter(|member| deviation(member) <= limit) {
        offset += (member.position - start.position) * member.weight;
        normal += member.normal * member.weight;
        weight += member.weight;
        colors.extend(color(member).map(|color| (color, member.weight)));
    }
    (start.position + offset / weight, normal.try_normalize().unwrap_or(start.normal), average_color(&colors))
}

/// The weighted mean of the colors whose brightness is within [`MAX_DEVIATIONS`] of the median: beside the
/// edge of a surface some views see what is behind it.
fn average_color(colors: &[(DVec3, f64)]) -> [u8; 3] {
    if colors.is_empty() {
        return GRAY;
    }
    let brightness = |color: DVec3| color.element_sum() / 3.0;
    let middle = median(colors.iter().map(|&(color, _)| brightness(color)).collect());
    let deviation = |color: DVec3| (brightness(color) - middle).abs();
    let limit = MAX_DEVIATIONS * median(colors.iter().map(|&(color, _)| deviation(color)).collect());
    let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
    for &(color, weight) in colors.iter().filter(|&&(color, _)| deviation(color) <= limit) {
        sum += color * weight;
        weights += weight;
    }
    (sum / weights).round().to_array().map(|channel| channel as u8)
}

/// The middle value, or the mean of the two in the middle. At least one value.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { (values[middle - 1] + values[middle]) / 2.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn member(height: f64) -> Member {
        Member { view: 0, slot: 0, pixel: 0, position: DVec3::Z * height, normal: DVec3::Z, weight: 1.0 }
    }

    #[test]
    fn a_member_far_from_the_others_is_left_out_even_if_it_is_the_start() {
        let members = [5.0, 0.0, 0.1, 0.2].map(member);
        let (position, ..) = average(&members, |_| None);
        assert!((position.z - 0.1).abs() < 1e-12, "{position}");
    }

    #[test]
    fn closer_views_weigh_more() {
        let mut members = [0.0, 1.0].map(member);
        members[1].weight = 3.0;
        let (position, _, color) =
            average(&members, |member| Some(DVec3::splat(if member.weight > 1.0 { 200.0 } else { 100.0 })));
        assert_eq!(position.z, 0.75);
        assert_eq!(color, [175; 3]);
    }

    #[test]
    fn members_without_pictures_do_not_darken_the_color() {
        let mut members = [0.0, 0.0].map(member);
        members[1].view = 1;
        let color = |member: &Member| (member.view == 0).then_some(DVec3::new(10.0, 20.0, 30.0));
        assert_eq!(average(&members, color).2, [10, 20, 30]);
        assert_eq!(average(&members, |_| None).2, GRAY);
    }
}
