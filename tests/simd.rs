//! Every back-end's operations against the scalar ones: the same bits.

use proptest::prelude::*;
use skep::simd::{LANES, SAMPLE_SCALE, Scalar, Simd, SimdLevel, Taps, Task, dispatch};

type Lanes = [f32; LANES];

/// The back-ends of this machine.
fn levels() -> impl Iterator<Item = SimdLevel> {
    SimdLevel::ALL.into_iter().filter(|level| level.is_available())
}

/// An operation written once for all back-ends.
trait Operation: Copy {
    fn run<S: Simd>(self, simd: S) -> Vec<Lanes>;
}

struct Vectorized<O>(O);

impl<O: Operation> Task for Vectorized<O> {
    type Output = (SimdLevel, Vec<Lanes>);

    fn run<S: Simd>(self, simd: S) -> Self::Output {
        (S::LEVEL, simd.vectorize(|| self.0.run(simd)))
    }
}

/// The bits, with one pattern for all that is not a number: which one is left open.
fn bits(lanes: &[Lanes]) -> Vec<u32> {
    let bits = |lane: &f32| if lane.is_nan() { f32::NAN.to_bits() } else { lane.to_bits() };
    lanes.iter().flatten().map(bits).collect()
}

fn check(operation: impl Operation) -> Result<(), TestCaseError> {
    let expected = operation.run(Scalar);
    for level in levels() {
        let (ran, lanes) = dispatch(level, Vectorized(operation));
        prop_assert_eq!(ran, level);
        prop_assert_eq!(
            bits(&lanes),
            bits(&expected),
            "{} gives {:?} and scalar {:?}",
            level.name(),
            lanes,
            expected
        );
    }
    Ok(())
}

#[derive(Clone, Copy)]
struct Arithmetic(Lanes, Lanes, Lanes);

impl Operation for Arithmetic {
    fn run<S: Simd>(self, simd: S) -> Vec<Lanes> {
        let (a, b, c) = (simd.load(&self.0), simd.load(&self.1), simd.load(&self.2));
        let results = [
            a,
            simd.splat(self.0[3]),
            simd.add(a, b),
            simd.sub(a, b),
            simd.mul(a, b),
            simd.div(a, b),
            simd.max(a, b),
            simd.min(a, b),
            simd.mul_add(a, b, c),
            simd.splat(simd.reduce_sum(a)),
            simd.sqrt(a),
            simd.splat(f32::from(simd.simd_ge(a, b))),
            simd.reduce_sum_8x8(&[a, b, c, a, b, c, a, b]),
            simd.select(0b1010_0110, a, b),
        ];
        results.map(|lanes| simd.store(lanes)).to_vec()
    }
}

#[derive(Clone, Copy)]
struct Whole(Lanes);

impl Operation for Whole {
    fn run<S: Simd>(self, simd: S) -> Vec<Lanes> {
        vec![simd.store(simd.trunc(simd.load(&self.0)))]
    }
}

#[derive(Clone, Copy)]
struct Largest(Lanes);

impl Operation for Largest {
    fn run<S: Simd>(self, simd: S) -> Vec<Lanes> {
        vec![[simd.reduce_max(simd.load(&self.0)); LANES]]
    }
}

#[derive(Clone, Copy)]
struct Places<'a>(&'a [i32; LANES], Lanes, Lanes);

impl Operation for Places<'_> {
    fn run<S: Simd>(self, simd: S) -> Vec<Lanes> {
        let places = simd.linear_indices(self.0, simd.load(&self.1), simd.load(&self.2));
        // Their bits: f32 does not hold every u32.
        vec![places.map(f32::from_bits)]
    }
}

#[derive(Clone, Copy)]
struct Bilinear<'a>(&'a Taps, Lanes, Lanes);

impl Operation for Bilinear<'_> {
    fn run<S: Simd>(self, simd: S) -> Vec<Lanes> {
        vec![simd.store(simd.sample_bilinear(simd.sample_positions(
            self.0,
            simd.load(&self.1),
            simd.load(&self.2),
        )))]
    }
}

#[derive(Clone, Copy)]
struct Gather<'a>(&'a Taps, &'a [u32; LANES]);

impl Operation for Gather<'_> {
    fn run<S: Simd>(self, simd: S) -> Vec<Lanes> {
        vec![simd.gather(self.0, self.1).map(f32::from_bits)]
    }
}

/// Any f32, with the special ones often.
fn any_lane() -> impl Strategy<Value = f32> {
    let special = [0.0, -0.0, 1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MIN_POSITIVE, f32::MAX];
    prop_oneof![any::<f32>(), -300.0..300.0f32, prop::sample::select(special.to_vec())]
}

fn any_lanes() -> impl Strategy<Value = Lanes> {
    prop::array::uniform8(any_lane())
}

fn whole_lanes(below: u32) -> impl Strategy<Value = Lanes> {
    prop::array::uniform8((0..below).prop_map(|lane| lane as f32))
}

prop_compose! {
    fn image()(width in 1..20usize, height in 1..20usize)(
        gray in prop::collection::vec(any::<u8>(), width * height),
        width in Just(width),
        height in Just(height),
    ) -> (Vec<u8>, usize, usize) {
        (gray, width, height)
    }
}

#[test]
fn eight_sums_stand_in_the_order_of_their_vectors() {
    #[derive(Clone, Copy)]
    struct Sums;
    impl Operation for Sums {
        fn run<S: Simd>(self, simd: S) -> Vec<Lanes> {
            let vectors = std::array::from_fn(|vector| simd.splat(vector as f32));
            vec![simd.store(simd.reduce_sum_8x8(&vectors))]
        }
    }
    check(Sums).unwrap();
    assert_eq!(Sums.run(Scalar), [[0.0, 8.0, 16.0, 24.0, 32.0, 40.0, 48.0, 56.0]]);
}

proptest! {
    #[test]
    fn arithmetic_gives_the_same_bits(a in any_lanes(), b in any_lanes(), c in any_lanes()) {
        check(Arithmetic(a, b, c))?;
    }

    #[test]
    fn whole_parts_give_the_same_bits(lanes in prop::array::uniform8(0.0..16_777_215.0f32)) {
        check(Whole(lanes))?;
        prop_assert_eq!(Whole(lanes).run(Scalar), vec![lanes.map(f32::trunc)]);
    }

    #[test]
    fn the_largest_lane_is_found_in_any_place(lanes in prop::array::uniform8(-1e9..1e9f32)) {
        check(Largest(lanes))?;
        let largest = lanes.into_iter().fold(f32::MIN, f32::max);
        prop_assert_eq!(Largest(lanes).run(Scalar), vec![[largest; LANES]]);
    }

    #[test]
    fn places_count_along_the_rows_of_each_lane_s_image(
        strides in prop::array::uniform8(0..50_000i32),
        x in whole_lanes(50_000),
        y in whole_lanes(40_000),
    ) {
        check(Places(&strides, x, y))?;
        let expected: [u32; LANES] =
            std::array::from_fn(|lane| y[lane] as u32 * strides[lane] as u32 + x[lane] as u32);
        prop_assert_eq!(Scalar.linear_indices(&strides, x, y), expected);
    }

    #[test]
    fn samples_between_pixels_are_the_weighted_mean_of_four(
        (gray, width, height) in image(),
        x in prop::array::uniform8(prop_oneof![-600.0..5_000.0f32, any_lane()]),
        y in prop::array::uniform8(prop_oneof![-600.0..5_000.0f32, any_lane()]),
    ) {
        let taps = Taps::new(&gray, width, height);
        check(Bilinear(&taps, x, y))?;
        let samples = Bilinear(&taps, x, y).run(Scalar)[0];
        for lane in 0..LANES {
            // The pixel before the place, and how far it is from there: of 256 parts, the last is the next pixel.
            let split = |at: f32, size: usize| {
                let parts = f64::from(at).max(0.0).min((size - 1) as f64 * 256.0).floor();
                ((parts / 256.0) as usize, parts % 256.0 / 255.0)
            };
            let ((column, along), (row, down)) = (split(x[lane], width), split(y[lane], height));
            let at = |column: usize, row: usize| {
                f64::from(gray[row.min(height - 1) * width + column.min(width - 1)])
            };
            let top = at(column, row) * (1.0 - along) + at(column + 1, row) * along;
            let low = at(column, row + 1) * (1.0 - along) + at(column + 1, row + 1) * along;
            let expected = top * (1.0 - down) + low * down;
            let sample = f64::from(samples[lane] / SAMPLE_SCALE) + 128.0;
            prop_assert!((sample - expected).abs() < 1e-4, "{} instead of {}", sample, expected);
        }
    }

    #[test]
    fn gathered_taps_are_those_of_two_pairs_also_beyond_the_end(
        (gray, width, height) in image(),
        at in prop::array::uniform8(prop_oneof![0..400u32, any::<u32>()]),
    ) {
        let taps = Taps::new(&gray, width, height);
        check(Gather(&taps, &at))?;
        for (gathered, index) in Scalar.gather(&taps, &at).into_iter().zip(at) {
            let index = (index as usize).min(taps.pairs().len() - 2);
            let [first, second] = [taps.pairs()[index], taps.pairs()[index + 1]];
            let expected = [first, second].concat();
            prop_assert_eq!(gathered.to_le_bytes().map(|byte| byte as i8).to_vec(), expected);
        }
    }
}

#[test]
fn the_larger_and_smaller_of_what_is_not_a_number_is_the_second() {
    let (nan, one) = ([f32::NAN; LANES], [1.0; LANES]);
    for (a, b) in [(nan, one), (one, nan)] {
        let results = Arithmetic(a, b, one).run(Scalar);
        assert_eq!(bits(&results[6..8]), bits(&[b, b]));
    }
    // Zeros of either sign are equal: the second again.
    let results = Arithmetic([0.0; LANES], [-0.0; LANES], one).run(Scalar);
    assert_eq!(bits(&results[6..8]), bits(&[[-0.0; LANES]; 2]));
}

#[test]
fn lanes_are_selected_by_their_bits_the_first_by_the_lowest() {
    let (a, b) = ([1.0; LANES], [2.0; LANES]);
    assert_eq!(Scalar.select(0b0000_0101, a, b), [1.0, 2.0, 1.0, 2.0, 2.0, 2.0, 2.0, 2.0]);
}

#[test]
fn lanes_are_added_in_the_documented_tree() {
    let l = [1e8, 3.0, -1e8, 0.1, 7.0, -2.5, 1.0, 1e-3];
    let tree = ((l[0] + l[4]) + (l[2] + l[6])) + ((l[1] + l[5]) + (l[3] + l[7]));
    let in_order = l.iter().fold(0.0f32, |sum, lane| sum + lane);
    assert_ne!(tree, in_order, "the lanes must tell the orders apart");
    assert_eq!(Scalar.reduce_sum(l), tree);
}

#[test]
fn there_are_levels_and_the_last_is_the_best_of_the_machine() {
    assert!(levels().take(2).eq([SimdLevel::Scalar, SimdLevel::Baseline]));
    assert!(SimdLevel::detect().is_available());
    // A machine whose AVX2 goes unused must not pass for tested.
    #[cfg(target_arch = "x86_64")]
    {
        let has_v3 = std::is_x86_feature_detected!("avx2")
            && std::is_x86_feature_detected!("bmi1")
            && std::is_x86_feature_detected!("bmi2")
            && std::is_x86_feature_detected!("popcnt");
        assert_eq!(SimdLevel::X86V3.is_available(), has_v3);
        if std::env::var_os("SKEP_SIMD").is_none() {
            let best = if has_v3 { SimdLevel::X86V3 } else { SimdLevel::Baseline };
            assert_eq!(SimdLevel::detect(), best);
        }
    }
}

#[test]
fn a_level_the_machine_lacks_is_lowered() {
    let (ran, _) = dispatch(SimdLevel::X86V3, Vectorized(Whole([0.0; LANES])));
    assert_eq!(ran, levels().last().unwrap());
}
