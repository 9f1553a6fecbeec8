//! Thinning of a cloud: one point for each voxel, or a number of points at most.
//!
//! Both read the points in their order and do not depend on the number of threads.

use super::cloud::{CloudSource, Emit, PointCloud};
use crate::error::Result;
use crate::options::FusionOptions;
use glam::DVec3;
use std::collections::HashMap;

/// Points of the result that are given out at a time.
const PART: usize = 1 << 14;

/// Parts of space, each of many blocks of voxels. Those that fit into memory are averaged at a time, in a
/// pass over the points: memory is bounded, and the order of the result does not depend on it.
const PARTS: usize = 256;
/// Voxels along the side of a block, all of one part: the result stays together in space.
const BLOCK: f64 = 64.0;
/// Bytes of memory for each voxel: sums, a list of views, and its share of the table.
const VOXEL_BYTES: usize = 300;

/// The mean of the points in a voxel, so far.
struct Voxel {
    /// Relative to the corner of the voxel: large coordinates lose no digits.
    position: DVec3,
    normal: DVec3,
    first_normal: [f32; 3],
    color: DVec3,
    points: f64,
    views: Vec<u32>,
}

/// Thins a cloud in memory as the options say.
pub(super) fn thin(mut cloud: PointCloud, options: &FusionOptions) -> Result<PointCloud> {
    let collect = |thin: &dyn Fn(Emit) -> Result<()>| {
        let mut result = PointCloud::default();
        thin(&mut |points| {
            result.append(points);
            Ok(())
        })?;
        Ok(result)
    };
    if options.voxel_size > 0.0 {
        cloud = collect(&|emit| thin_by_voxels(&cloud, options.voxel_size, usize::MAX, emit))?;
    }
    match options.max_points as usize {
        most if most > 0 && most < cloud.len() => collect(&|emit| draw(&cloud, most, emit)),
        _ => Ok(cloud),
    }
}

/// Gives `emit` one point for each voxel of this size that has any: means of position and color, the
/// normalized mean of the normals, and all views. The order is by parts of space, in each by the first point
/// of the voxel. Takes about `memory` bytes; more where a single part has more points than fit.
///
/// # Errors
/// Points that cannot be read; what `emit` returns.
pub(crate) fn thin_by_voxels(cloud: &dyn CloudSource, size: f64, memory: usize, emit: Emit) -> Result<()> {
    let mut counts = [0usize; PARTS];
    cloud.each_part(&mut |points| {
        points.positions.iter().for_each(|&position| counts[part(position, size)] += 1);
        Ok(())
    })?;
    let most = memory / VOXEL_BYTES;
    let mut first = 0;
    while first < PARTS {
        let (mut last, mut points) = (first, 0);
        while last < PARTS && (last == first || points + counts[last] <= most) {
            points += counts[last];
            last += 1;
        }
        if points > 0 {
            average_parts(cloud, size, first..last, emit)?;
        }
        first = last;
    }
    Ok(())
}

/// Averages the voxels of some parts of space.
fn average_parts(
    cloud: &dyn CloudSource,
    size: f64,
    parts: std::ops::Range<usize>,
    emit: Emit,
) -> Result<()> {
    // By part, in the order of the first points; the table tells the place of a voxel.
    let mut voxels: Vec<Vec<Voxel>> = parts.clone().map(|_| Vec::new()).collect();
    let mut places: HashMap<[u64; 3], usize> = HashMap::new();
    let mut corners: Vec<Vec<DVec3>> = parts.clone().map(|_| Vec::new()).collect();
    cloud.each_part(&mut |points| {
        for (index, &position) in points.positions.iter().enumerate() {
            let part = part(position, size);
            if !parts.contains(&part) {
                continue;
            }
            let part = part - parts.start;
            let cell = cell(position, size);
            let place = *places.entry(cell.to_array().map(f64::to_bits)).or_insert_with(|| {
                corners[part].push(cell * size);
                voxels[part].push(Voxel::new(points.normals[index]));
                voxels[part].len() - 1
            });
            let relative = DVec3::from(position) - corners[part][place];
            voxels[part][place].add(points, index, relative);
        }
        Ok(())
    })?;
    drop(places);
    for (voxels, corners) in voxels.into_iter().zip(corners) {
        let mut result = PointCloud::default();
        for (voxel, corner) in voxels.into_iter().zip(corners) {
            voxel.push_to(&mut result, corner);
            if result.positions.len() == PART {
                emit(&std::mem::take(&mut result))?;
            }
        }
        if !result.positions.is_empty() {
            emit(&result)?;
        }
    }
    Ok(())
}

impl Voxel {
    fn new(first_normal: [f32; 3]) -> Voxel {
        Voxel {
            position: DVec3::ZERO,
            normal: DVec3::ZERO,
            first_normal,
            color: DVec3::ZERO,
            points: 0.0,
            views: Vec::new(),
        }
    }

    fn add(&mut self, points: &PointCloud, index: usize, position: DVec3) {
        self.position += position;
        self.normal += DVec3::from_array(points.normals[index].map(f64::from));
        self.color += DVec3::from_array(points.colors[index].map(f64::from));
        self.points += 1.0;
        for view in points.views.get(index) {
            if !self.views.contains(view) {
                self.views.push(*view);
            }
        }
    }

    fn push_to(self, cloud: &mut PointCloud, corner: DVec3) {
        cloud.positions.push((corner + self.position / self.points).to_array());
        // Opposite normals of a thin sheet may cancel out.
        let normal = self.normal.try_normalize().map(|normal| normal.as_vec3().to_array());
        cloud.normals.push(normal.unwrap_or(self.first_normal));
        cloud.colors.push((self.color / self.points).round().to_array().map(|channel| channel as u8));
        cloud.views.push(&self.views);
    }
}

/// The voxel of a position: whole numbers.
fn cell(position: [f64; 3], size: f64) -> DVec3 {
    // Adding 0 makes one zero of both.
    (DVec3::from(position) / size).floor() + 0.0
}

/// The part of space of a position.
fn part(position: [f64; 3], size: f64) -> usize {
    let block = (cell(position, size) / BLOCK).floor() + 0.0;
    let hash = block.to_array().iter().fold(0, |hash, number| mixed(hash ^ number.to_bits()));
    hash as usize % PARTS
}

/// Gives `emit` so many of the points at most, in their order: each subset of that size is equally likely.
///
/// # Errors
/// Points that cannot be read; what `emit` returns.
pub(crate) fn draw(cloud: &dyn CloudSource, count: usize, emit: Emit) -> Result<()> {
    // Knuth's selection sampling: each point with the chance of those that are still wanted among those left.
    let (mut wanted, mut left) = (count.min(cloud.len()), cloud.len());
    cloud.each_part(&mut |points| {
        let mut drawn = PointCloud::default();
        for index in 0..points.positions.len() {
            let uniform = (mixed(left as u64) >> 11) as f64 / (1u64 << 53) as f64;
            if uniform * (left as f64) < wanted as f64 {
                drawn.positions.push(points.positions[index]);
                drawn.normals.push(points.normals[index]);
                drawn.colors.push(points.colors[index]);
                drawn.views.push(points.views.get(index));
                wanted -= 1;
            }
            left -= 1;
        }
        if drawn.positions.is_empty() { Ok(()) } else { emit(&drawn) }
    })
}

/// The finalizer of SplitMix64: every bit of the number changes about half of the bits.
fn mixed(number: u64) -> u64 {
    let mut bits = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a wavy surface far from the origin, in parts of different sizes.
    struct Parts(Vec<PointCloud>);

    impl CloudSource for Parts {
        fn len(&self) -> usize {
            self.0.iter().map(|part| part.positions.len()).sum()
        }

        fn each_part(&self, body: &mut dyn FnMut(&PointCloud) -> Result<()>) -> Result<()> {
            self.0.iter().try_for_each(body)
        }
    }

    fn surface(count: usize) -> PointCloud {
        let mut cloud = PointCloud::default();
        for index in 0..count {
            let (u, v) = ((index % 300) as f64 * 0.01, (index / 300) as f64 * 0.01);
            cloud.positions.push([4.1e6 + u, -9e5 + v, 4.7e6 + 0.1 * (3.0 * u).sin()]);
            cloud.normals.push([0.0, 0.6, -0.8]);
            cloud.colors.push([(index % 256) as u8, 7, 200]);
            cloud.views.push(&[(index % 5) as u32, 9]);
        }
        cloud
    }

    fn collected(thin: impl Fn(&mut dyn FnMut(&PointCloud) -> Result<()>) -> Result<()>) -> PointCloud {
        let mut result = PointCloud::default();
        thin(&mut |points| {
            result.append(points);
            Ok(())
        })
        .unwrap();
        result
    }

    #[test]
    fn a_voxel_gives_one_point_of_means_and_all_its_views() {
        let mut cloud = PointCloud {
            positions: vec![[1e6 + 0.25, -0.5, 0.0], [1e6 + 0.75, -0.25, 0.5], [1e6 + 1.5, 0.0, 0.0]],
            normals: vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            colors: vec![[0, 100, 255], [11, 101, 255], [1, 2, 3]],
            ..PointCloud::default()
        };
        [&[4u32, 1][..], &[1, 7], &[2]].iter().for_each(|views| cloud.views.push(views));
        let mut found = collected(|emit| thin_by_voxels(&cloud, 1.0, 1 << 20, emit));
        if found.positions[0][0] > 1e6 + 1.0 {
            // The order of the two depends on the parts of space they are in.
            found.positions.swap(0, 1);
            found.normals.swap(0, 1);
            found.colors.swap(0, 1);
        } else {
            assert_eq!((found.views.get(0), found.views.get(1)), (&[4, 1, 7][..], &[2][..]));
        }
        assert_eq!(found.positions, [[1e6 + 0.5, -0.375, 0.25], [1e6 + 1.5, 0.0, 0.0]]);
        let half = std::f32::consts::FRAC_1_SQRT_2;
        assert_eq!(found.normals, [[half, half, 0.0], [0.0, 0.0, 1.0]]);
        assert_eq!(found.colors, [[6, 101, 255], [1, 2, 3]]);
    }

    #[test]
    fn neither_parts_nor_memory_change_a_bit_of_the_voxels() {
        let cloud = surface(60_000);
        let expected = collected(|emit| thin_by_voxels(&cloud, 0.03, usize::MAX, emit));
        let count = expected.positions.len();
        assert!((6_000..12_000).contains(&count), "{count}: about a ninth");
        assert_eq!(expected.views.len(), count);
        let part = |from: usize, to: usize| {
            let mut points = PointCloud {
                positions: cloud.positions[from..to].to_vec(),
                normals: cloud.normals[from..to].to_vec(),
                colors: cloud.colors[from..to].to_vec(),
                ..PointCloud::default()
            };
            (from..to).for_each(|index| points.views.push(cloud.views.get(index)));
            points
        };
        let divided = Parts(vec![part(0, 1), part(1, 40_000), part(40_000, 60_000)]);
        assert!(collected(|emit| thin_by_voxels(&divided, 0.03, 100 * VOXEL_BYTES, emit)) == expected);
    }

    #[test]
    fn so_many_points_are_drawn_from_everywhere() {
        let cloud = surface(60_000);
        let drawn = collected(|emit| draw(&cloud, 6_000, emit));
        assert_eq!((drawn.positions.len(), drawn.views.len()), (6_000, 6_000));
        let in_first_half = drawn.positions.iter().filter(|position| position[1] < -9e5 + 1.0).count();
        assert!((2_850..3_150).contains(&in_first_half), "{in_first_half}");
        assert!(collected(|emit| draw(&cloud, 60_000, emit)) == cloud);
        assert_eq!(collected(|emit| draw(&cloud, 0, emit)).positions.len(), 0);
    }
}
