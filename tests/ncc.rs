//! The patch cost of every back-end against a direct computation of the bilaterally weighted NCC in f64.

use glam::Vec3;
use proptest::prelude::*;
use skep::image::{PackedImage, Picture};
use skep::matching::{MAX_COST, PatchHomography, ReferencePatch, Window, patch_cost, patch_costs};
use skep::simd::{Simd, SimdLevel, Task, dispatch};

const WIDTH: u32 = 24;
const HEIGHT: u32 = 18;

/// The window of the tests. With an odd radius and an even step the center is not a sample.
const RADIUS: i32 = 5;
const STEP: usize = 2;
const SIGMA_SPATIAL: f64 = 4.0;
const SIGMA_COLOR: f64 = 0.2;
const MIN_VARIANCE: f64 = 1e-5;

fn window() -> Window {
    Window::new(RADIUS as u32, STEP as u32, SIGMA_SPATIAL, SIGMA_COLOR, MIN_VARIANCE)
}

fn picture(gray: impl Fn(i32, i32) -> u8) -> Picture {
    let pixels = (0..HEIGHT as i32).flat_map(|y| (0..WIDTH as i32).map(move |x| (x, y)));
    Picture::from_gray(WIDTH, HEIGHT, pixels.map(|(x, y)| gray(x, y)).collect()).unwrap()
}

/// The homography that translates by an offset.
fn translation((x, y): (usize, usize), (dx, dy): (f32, f32)) -> PatchHomography {
    let center = Vec3::new(x as f32 + dx, y as f32 + dy, 1.0);
    PatchHomography { center, along_x: Vec3::X, along_y: Vec3::Y }
}

/// One patch cost: images, reference pixel and homography.
#[derive(Debug, Clone)]
struct Case {
    reference: Picture,
    source: Picture,
    pixel: (usize, usize),
    homography: PatchHomography,
}

struct Cost<'a>(&'a Case);

impl Task for Cost<'_> {
    type Output = f32;

    fn run<S: Simd>(self, simd: S) -> f32 {
        let Case { reference, source, pixel: (x, y), homography } = self.0;
        let (reference, source) = (PackedImage::new(reference), PackedImage::new(source));
        let window = window();
        let mut patch = ReferencePatch::new(&window);
        simd.vectorize(
            #[inline(always)]
            || {
                patch.sample(simd, &window, &reference, *x, *y);
                let cost = patch_cost(simd, &window, &patch, &source, homography);
                // `patch_costs` gives the same bits, in any lane and with any other views.
                let other = PatchHomography { center: homography.center + Vec3::X, ..*homography };
                for (lane, wanted) in [(0, 0b1), (2, 0b1_1111), (3, 0b1010_1010), (7, u8::MAX)] {
                    let view = |index| {
                        assert!(wanted >> index & 1 != 0, "view {index} is not wanted");
                        (&source, if index == lane { *homography } else { other })
                    };
                    let costs = patch_costs(simd, &window, &patch, view, wanted);
                    assert_eq!(costs[lane].to_bits(), cost.to_bits(), "lane {lane}: {costs:?}");
                    let others = costs.iter().enumerate().filter(|(lane, _)| wanted >> lane & 1 == 0);
                    assert!(others.map(|(_, &cost)| cost).all(|cost| cost == MAX_COST));
                }
                cost
            },
        )
    }
}

impl Case {
    fn new(reference: Picture, source: Picture, pixel: (usize, usize), offset: (f32, f32)) -> Case {
        Case { reference, source, pixel, homography: translation(pixel, offset) }
    }

    /// The cost; asserts that it has the same bits on all back-ends.
    fn cost(&self) -> f32 {
        let cost = dispatch(SimdLevel::Scalar, Cost(self));
        for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
            let other = dispatch(level, Cost(self));
            assert_eq!(other.to_bits(), cost.to_bits(), "{}: {other} instead of {cost}", level.name());
        }
        cost
    }
}

fn gray_at(picture: &Picture, x: usize, y: usize) -> f64 {
    f64::from(picture.gray()[y * picture.width() as usize + x])
}

/// A bilinear sample at a position given by [`quantized`].
fn bilinear(picture: &Picture, x: f64, y: f64) -> f64 {
    let (column, row) = (x as usize, y as usize);
    let (right, below) =
        ((column + 1).min(picture.width() as usize - 1), (row + 1).min(picture.height() as usize - 1));
    let (fx, fy) = (x.fract(), y.fract());
    let top = gray_at(picture, column, row) * (1.0 - fx) + gray_at(picture, right, row) * fx;
    let bottom = gray_at(picture, column, below) * (1.0 - fx) + gray_at(picture, right, below) * fx;
    top * (1.0 - fy) + bottom * fy
}

/// The coordinate truncated to 1/256 px, with the weights of the kernels: a fraction of f / 256 weighs f /
/// 255.
fn quantized(coordinate: f64) -> f64 {
    coordinate.floor() + (coordinate.fract() * 256.0).floor() / 255.0
}

/// A coordinate clamped to the image, and its possible error in f32: some ulp of the terms it is the sum of,
/// divided by the third coordinate; 0 where both ends of that interval lie beyond the same border.
fn clamped(terms: [f64; 3], z_terms: [f64; 3], last: u32) -> (f64, f64) {
    let magnitude = |terms: [f64; 3]| terms.iter().map(|term| term.abs()).sum::<f64>();
    let ulps = 6.0 * f64::from(f32::EPSILON);
    let (sum, z): (f64, f64) = (terms.iter().sum(), z_terms.iter().sum());
    let coordinate = sum / z;
    let clamp = |coordinate: f64| quantized(coordinate.max(0.0).min(f64::from(last)));
    if z.abs() <= ulps * magnitude(z_terms) {
        return (clamp(coordinate), f64::from(last));
    }
    let error = ulps * (magnitude(terms) + coordinate.abs() * magnitude(z_terms)) / z.abs();
    (clamp(coordinate), clamp(coordinate + error) - clamp(coordinate - error))
}

struct Direct {
    cost: f64,
    /// Possible error of an f32 computation of the cost.
    tolerance: f64,
    /// Variances of reference and source, in squared intensities.
    variances: [f64; 2],
}

/// The textbook NCC in f64: weights from the reference, weighted means, variances and covariance.
fn direct(case: &Case) -> Direct {
    let Case { reference, source, pixel: (x, y), homography } = case;
    let center = gray_at(reference, *x, *y) / 255.0;
    let (mut samples, mut errors) = (Vec::new(), Vec::new());
    for dy in (-RADIUS..=RADIUS).step_by(STEP) {
        for dx in (-RADIUS..=RADIUS).step_by(STEP) {
            let (column, row) = (*x as i32 + dx, *y as i32 + dy);
            if column < 0 || row < 0 || column >= WIDTH as i32 || row >= HEIGHT as i32 {
                continue;
            }
            let (dx, dy) = (f64::from(dx), f64::from(dy));
            let PatchHomography { center: c, along_x: h, along_y: v } = *homography;
            let terms = |c: f32, h: f32, v: f32| [f64::from(c), dx * f64::from(h), dy * f64::from(v)];
            let z = terms(c.z, h.z, v.z);
            let (source_x, error_x) = clamped(terms(c.x, h.x, v.x), z, WIDTH - 1);
            let (source_y, error_y) = clamped(terms(c.y, h.y, v.y), z, HEIGHT - 1);

            let a = gray_at(reference, column as usize, row as usize) / 255.0;
            let b = bilinear(source, source_x, source_y) / 255.0;
            let space = (dx * dx + dy * dy) / (2.0 * SIGMA_SPATIAL * SIGMA_SPATIAL);
            let color = (a - center).powi(2) / (2.0 * SIGMA_COLOR * SIGMA_COLOR);
            samples.push(((-space - color).exp(), a, b));
            // Intensities change by at most 1 from one pixel to the next.
            errors.push((error_x + error_y).min(1.0));
        }
    }
    let total: f64 = samples.iter().map(|s| s.0).sum();
    let mean =
        |value: &dyn Fn(&(f64, f64, f64)) -> f64| samples.iter().map(|s| s.0 / total * value(s)).sum::<f64>();
    let (mean_a, mean_b) = (mean(&|s| s.1), mean(&|s| s.2));
    let variances = [mean(&|s| (s.1 - mean_a).powi(2)), mean(&|s| (s.2 - mean_b).powi(2))];
    let covariance = mean(&|s| (s.1 - mean_a) * (s.2 - mean_b));
    let textured = variances.iter().all(|&variance| variance >= MIN_VARIANCE);
    let ncc = covariance / (variances[0] * variances[1]).sqrt();
    // An error of the source samples changes the correlation by at most twice the ratio of its deviation to
    // theirs. To it comes the rounding of single-pass sums, whose terms exceed the variance by the squared
    // difference of the means.
    let squares: f64 = samples.iter().zip(&errors).map(|(s, error)| s.0 / total * error * error).sum();
    let deviation = variances[1].sqrt().max(1e-9);
    let single_pass = 1e-5 * (1.0 + (mean_a - mean_b).powi(2) / variances[1].max(1e-9));
    Direct {
        cost: if textured { (1.0 - ncc).clamp(0.0, 2.0) } else { 2.0 },
        tolerance: single_pass + 3.0 * squares.sqrt() / deviation,
        variances,
    }
}

/// Uniform noise between two gray values.
fn noise() -> impl Strategy<Value = Picture> {
    let values = prop::collection::vec(0.0..1.0f64, (WIDTH * HEIGHT) as usize);
    (values, 0.0..255.0f64, 0.0..255.0f64).prop_map(|(values, a, b)| {
        let gray = values.iter().map(|value| (a + (b - a) * value).round() as u8);
        Picture::from_gray(WIDTH, HEIGHT, gray.collect()).unwrap()
    })
}

prop_compose! {
    /// Homographies of all kinds: near the identity, at grazing incidence, outside the image, behind the
    /// camera.
    fn homography()(
        center in (-10.0..34.0f32, -10.0..28.0f32),
        along_x in prop::array::uniform2(-1.5..1.5f32),
        along_y in prop::array::uniform2(-1.5..1.5f32),
        z in (prop_oneof![4 => 0.3..2.0f32, 1 => -1.0..1.0f32], -0.05..0.05f32, -0.05..0.05f32),
    ) -> PatchHomography {
        PatchHomography {
            center: Vec3::new(center.0, center.1, 1.0) * z.0,
            along_x: Vec3::new(along_x[0], along_x[1], z.1),
            along_y: Vec3::new(along_y[0], along_y[1], z.2),
        }
    }
}

prop_compose! {
    fn case()(
        reference in noise(),
        source in noise(),
        x in 0..WIDTH as usize,
        y in 0..HEIGHT as usize,
        homography in homography(),
    ) -> Case {
        Case { reference, source, pixel: (x, y), homography }
    }
}

proptest! {
    #[test]
    fn every_back_end_computes_the_textbook_cost(case in case()) {
        let cost = f64::from(case.cost());
        prop_assert!((0.0..=2.0).contains(&cost), "cost {}", cost);
        let direct = direct(&case);
        // Near the threshold either result is correct.
        let is_off_threshold = |variance: &f64| (variance / MIN_VARIANCE - 1.0).abs() > 0.05;
        if direct.variances.iter().all(is_off_threshold) && direct.tolerance < 0.05 {
            let difference = (cost - direct.cost).abs();
            prop_assert!(difference <= direct.tolerance, "{} instead of {}", cost, direct.cost);
        }
    }

    #[test]
    fn a_patch_costs_0_with_itself_and_2_with_its_negative(
        reference in noise(),
        x in 0..WIDTH as usize,
        y in 0..HEIGHT as usize,
    ) {
        let same = Case::new(reference.clone(), reference.clone(), (x, y), (0.0, 0.0));
        prop_assume!(direct(&same).variances[0] > 1.05 * MIN_VARIANCE);
        prop_assert!(same.cost() < 1e-5);
        let inverted = reference.gray().iter().map(|gray| 255 - gray).collect();
        let inverted = Picture::from_gray(WIDTH, HEIGHT, inverted).unwrap();
        let case = Case::new(reference, inverted, (x, y), (0.0, 0.0));
        prop_assert!(f64::from(case.cost()) > 2.0 - direct(&case).tolerance);
    }
}

/// Pseudo-random gray values, multiples of 4 so that halves are exact.
fn texture(x: i32, y: i32) -> u8 {
    ((x * 7919 + y * 104_729 + x * y * 31) % 61).unsigned_abs() as u8 * 4
}

#[test]
fn most_random_cases_have_a_small_tolerance() {
    use proptest::strategy::ValueTree;
    use proptest::test_runner::TestRunner;
    let mut runner = TestRunner::deterministic();
    let tolerances = (0..200).map(|_| direct(&case().new_tree(&mut runner).unwrap().current()).tolerance);
    let mut tolerances: Vec<f64> = tolerances.collect();
    tolerances.sort_by(f64::total_cmp);
    assert!(tolerances[120] < 0.01, "{tolerances:?}");
}

#[test]
fn cost_is_invariant_to_brightness_and_contrast() {
    let reference = picture(texture);
    let darker = picture(|x, y| texture(x, y) / 2 + 40);
    assert!(Case::new(reference.clone(), darker.clone(), (12, 9), (0.0, 0.0)).cost() < 1e-5);
    assert!(Case::new(darker, reference, (12, 9), (0.0, 0.0)).cost() < 1e-5);
}

#[test]
fn the_true_translation_costs_least_also_at_borders() {
    let reference = picture(texture);
    for (pixel, (dx, dy)) in [((12, 9), (3, -2)), ((0, 8), (3, -2)), ((12, 17), (-3, -2)), ((23, 0), (-3, 2))]
    {
        let moved = picture(|x, y| texture(x - dx, y - dy));
        let cost = |dx, dy| Case::new(reference.clone(), moved.clone(), pixel, (dx, dy)).cost();
        let (moved, unmoved) = (cost(dx as f32, dy as f32), cost(0.0, 0.0));
        assert!(moved < 1e-5 && unmoved > 0.02, "{pixel:?}: {moved} and {unmoved}");
    }
}

#[test]
fn samples_half_way_between_pixels_are_their_mean() {
    let reference = picture(|x, y| ((texture(x, y) / 4) + (texture(x + 1, y) / 4)) * 2);
    let source = picture(texture);
    assert!(Case::new(reference, source, (12, 9), (0.5, 0.0)).cost() < 1e-5);
}

#[test]
fn patches_without_texture_cost_the_maximum() {
    let (flat, textured) = (picture(|_, _| 90), picture(texture));
    assert_eq!(Case::new(flat.clone(), textured.clone(), (12, 9), (0.0, 0.0)).cost(), MAX_COST);
    assert_eq!(Case::new(textured.clone(), flat.clone(), (12, 9), (0.0, 0.0)).cost(), MAX_COST);
    assert_eq!(Case::new(flat.clone(), flat, (12, 9), (0.0, 0.0)).cost(), MAX_COST);
    // All samples are clamped to one corner pixel.
    assert_eq!(Case::new(textured.clone(), textured, (12, 9), (1000.0, 1000.0)).cost(), MAX_COST);
}

#[test]
fn stripes_of_one_gray_value_are_no_texture_and_of_four_are() {
    // Stripes two pixels wide: a window with step 2 samples them in turn.
    let stripes = |height: u8| picture(move |x, _| 100 + height * (x / 2 % 2) as u8);
    let cost = |height| Case::new(stripes(height), stripes(height), (12, 9), (0.0, 0.0)).cost();
    assert_eq!(cost(1), MAX_COST);
    assert!(cost(4) < 1e-5);
}

#[test]
fn degenerate_homographies_cost_the_maximum() {
    let textured = picture(texture);
    for center in [Vec3::NAN, Vec3::ZERO, Vec3::INFINITY] {
        let homography = PatchHomography { center, along_x: Vec3::ZERO, along_y: Vec3::ZERO };
        let case = Case { reference: textured.clone(), source: textured.clone(), pixel: (12, 9), homography };
        assert_eq!(case.cost(), MAX_COST);
    }
}

#[test]
fn images_smaller_than_the_window_are_matched() {
    for (width, height) in [(1, 1), (1, 9), (9, 1), (2, 3)] {
        let gray: Vec<u8> = (0..width * height).map(|pixel| (pixel * 53 % 200) as u8).collect();
        let tiny = Picture::from_gray(width, height, gray).unwrap();
        for pixel in 0..(width * height) as usize {
            let position = (pixel % width as usize, pixel / width as usize);
            let cost = Case::new(tiny.clone(), tiny.clone(), position, (0.0, 0.0)).cost();
            assert!((0.0..1e-5).contains(&cost) || cost == MAX_COST, "{width}x{height} {position:?}: {cost}");
        }
    }
}

#[test]
fn windows_report_the_number_of_their_samples() {
    assert_eq!(window().samples(), 36);
    assert_eq!(Window::new(5, 1, 5.0, 0.2, 1e-5).samples(), 121);
    assert_eq!(Window::new(1, 3, 5.0, 0.2, 1e-5).samples(), 1);
    // Without three samples in each corner, and without the corners alone.
    assert_eq!(Window::disc(5, 2, 5.0, 0.2, 1e-5).samples(), 24);
    assert_eq!(Window::disc(2, 1, 5.0, 0.2, 1e-5).samples(), 21);
}
