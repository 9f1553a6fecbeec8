//! Stepwise runs: the same bits as a whole run, estimates as bytes, and maps of the host.

mod common;

use common::changed;
use common::procedural;
use skep::{
    AnyEstimate, Candidates, Checked, Error, EstimateRef, Options, OwnMaps, Reconstruction, Scale, Scene,
    Searched, Stepper, ViewEstimate, ignore_progress,
};
use std::ops::ControlFlow;

fn options() -> Options {
    changed(Options::default(), |o| {
        o.schedule.scales = vec![
            Scale { downscale: 2, food_sources: 3, first_iterations: 3, cycles: 2, cycle_iterations: 1 },
            Scale { downscale: 1, food_sources: 2, first_iterations: 1, cycles: 1, cycle_iterations: 1 },
        ];
        o.threads = 2;
    })
}

fn scene() -> Scene {
    procedural::plane_and_sphere().only(&[0, 1, 2, 3]).scene()
}

fn known<S>(estimates: &[ViewEstimate<S>]) -> Vec<Option<&ViewEstimate<S>>> {
    estimates.iter().map(Some).collect()
}

fn sources(estimates: &[ViewEstimate<Searched>]) -> Vec<Option<EstimateRef<'_>>> {
    estimates.iter().map(|estimate| Some(estimate.into())).collect()
}

/// What happens to estimates between two calls.
trait Travel {
    fn searched(&self, estimate: ViewEstimate<Searched>) -> ViewEstimate<Searched> {
        estimate
    }

    fn checked(&self, estimate: ViewEstimate<Checked>) -> ViewEstimate<Checked> {
        estimate
    }
}

struct InMemory;

impl Travel for InMemory {}

struct AsBytes<'a>(&'a Stepper);

impl Travel for AsBytes<'_> {
    fn searched(&self, estimate: ViewEstimate<Searched>) -> ViewEstimate<Searched> {
        let bytes = estimate.to_bytes();
        assert_eq!(bytes.len(), estimate.byte_len());
        match AnyEstimate::from_bytes(self.0, &bytes).unwrap() {
            AnyEstimate::Searched(estimate) => estimate,
            AnyEstimate::Checked(_) => panic!("it was not checked"),
        }
    }

    fn checked(&self, estimate: ViewEstimate<Checked>) -> ViewEstimate<Checked> {
        let bytes = estimate.to_bytes();
        assert_eq!(bytes.len(), estimate.byte_len());
        match AnyEstimate::from_bytes(self.0, &bytes).unwrap() {
            AnyEstimate::Checked(estimate) => estimate,
            AnyEstimate::Searched(_) => panic!("it was checked"),
        }
    }
}

/// One cycle of all views, the last view first.
fn run_cycle(
    stepper: &Stepper,
    cycle: usize,
    estimates: &[ViewEstimate<Checked>],
    travel: &dyn Travel,
) -> Vec<ViewEstimate<Checked>> {
    let search = |view: usize| {
        let candidates = stepper.propagate(cycle, view, &known(estimates)).unwrap();
        let known = known(estimates);
        travel.searched(stepper.search(cycle, view, &known, Some(&candidates), &ignore_progress).unwrap())
    };
    let mut searched: Vec<_> = (0..stepper.views()).rev().map(search).collect();
    searched.reverse();
    let check =
        |own: &ViewEstimate<Searched>| travel.checked(stepper.check(own, &sources(&searched)).unwrap());
    let mut checked: Vec<_> = searched.iter().rev().map(check).collect();
    checked.reverse();
    checked
}

fn run(stepper: &Stepper, travel: &dyn Travel) -> Vec<ViewEstimate<Checked>> {
    let mut estimates = Vec::new();
    let mut next = Some(0);
    while let Some(cycle) = next {
        estimates = run_cycle(stepper, cycle, &estimates, travel);
        next = stepper.next(cycle, &known(&estimates)).unwrap();
        if let Some(next) = next.filter(|&next| stepper.size(next, 0) != stepper.size(cycle, 0)) {
            let upsample = |own: &ViewEstimate<Checked>| travel.checked(stepper.upsample(next, own).unwrap());
            estimates = estimates.iter().map(upsample).collect();
        }
    }
    estimates
}

fn assert_same(stepper: &Stepper, estimates: &[ViewEstimate<Checked>], whole: &Reconstruction) {
    let mut results = Vec::new();
    for (view, expected) in whole.views.iter().enumerate() {
        let found = stepper.finish(view, &known(estimates), &ignore_progress).unwrap();
        results.push(found.clone());
        assert_eq!(found.raw, expected.raw, "maps of view {view}");
        assert_eq!(found.status, expected.status);
        assert_eq!(found.cost, expected.cost);
        assert_eq!(found.view_sets, expected.view_sets);
        assert_eq!(found.sources, expected.sources);
        assert_eq!((found.counts, found.cycles), (expected.counts, expected.cycles.clone()));
    }
    assert_eq!(stepper.fuse(&scene(), &results, &ignore_progress).unwrap(), whole.points);
    let refused = stepper.fuse(&scene(), &results[1..], &ignore_progress).unwrap_err().to_string();
    assert!(refused.starts_with("results is 3 views"), "{refused}");
}

#[test]
fn cycles_one_by_one_give_the_bits_of_the_whole_run() {
    let (scene, options) = (scene(), options());
    let whole = skep::reconstruct(&scene, &options, &ignore_progress).unwrap();
    assert!(whole.views[0].status_counts()[0] > 5000);
    let stepper = Stepper::new(&scene, &options).unwrap();
    assert_same(&stepper, &run(&stepper, &InMemory), &whole);
    assert_same(&stepper, &run(&stepper, &AsBytes(&stepper)), &whole);
}

#[test]
fn a_scale_in_which_little_changes_ends_early() {
    let options = changed(options(), |o| {
        o.schedule.min_changed_fraction = 1.0;
    });
    let stepper = Stepper::new(&scene(), &options).unwrap();
    let estimates = run(&stepper, &InMemory);
    let cycles: Vec<(u32, u32)> = estimates[0].cycles().iter().map(|c| (c.downscale, c.cycle)).collect();
    // The first cycle changes every pixel; after the second the scale ends, whatever it changes.
    assert_eq!(cycles, [(2, 0), (2, 1), (1, 0), (1, 1)]);
}

#[test]
fn maps_of_the_host_s_own_validate_and_guide_another_view() {
    let made = procedural::plane_and_sphere().only(&[0, 1, 2, 3]);
    let scene = made.scene();
    let options = changed(options(), |o| {
        o.schedule.scales = vec![options().schedule.scales[1]];
        // Only within 1 % of the depth, by several views: planes of a search at random are checked.
        (o.check.reprojection_tolerance, o.check.few_views) = (0.0, 0);
    });
    let stepper = Stepper::new(&scene, &options).unwrap();
    let own = |view: usize| {
        let own = OwnMaps { maps: &made.truth[view], validated: None, cost: None };
        ViewEstimate::from_maps(&stepper, 1, view, &own).unwrap()
    };
    let neighbors: Vec<ViewEstimate<Checked>> = (0..4).map(own).collect();
    // View 0 has no estimate: its planes come from the others' maps.
    let alone = stepper.search(1, 0, &[], None, &ignore_progress).unwrap();
    let others = [None, Some(&neighbors[1]), Some(&neighbors[2]), Some(&neighbors[3])];
    let guided = stepper.search(1, 0, &others, None, &ignore_progress).unwrap();
    let good = |estimate: &ViewEstimate<Searched>| {
        let truth = made.truth[0].depth.iter().zip(estimate.maps().depth);
        truth.filter(|(truth, depth)| (*depth / **truth - 1.0).abs() < 0.01).count()
    };
    assert!(good(&guided) > good(&alone), "{} with neighbors, {} without", good(&guided), good(&alone));
    let refs: Vec<Option<EstimateRef>> = others.iter().map(|other| other.map(EstimateRef::from)).collect();
    let checked = stepper.check(&guided, &refs).unwrap();
    let depths = checked.maps().depth.into_iter().zip(&made.truth[0].depth);
    let validated = depths.zip(checked.verdicts()).filter(|(_, verdict)| verdict.1);
    let errors: Vec<f32> = validated.map(|((depth, truth), _)| depth / truth - 1.0).collect();
    assert!(errors.len() > 10 && errors.iter().all(|error| error.abs() < 0.03), "{errors:?}");

    let costs: Vec<f32> = guided.cost().collect();
    let none = vec![false; guided.pixels()];
    let own = OwnMaps { maps: &guided.maps(), validated: Some(&none), cost: Some(&costs) };
    let mut all = neighbors.clone();
    all[0] = ViewEstimate::from_maps(&stepper, 1, 0, &own).unwrap();
    let candidates = stepper.propagate(1, 0, &known(&all)).unwrap();
    let with_candidates = stepper.search(1, 0, &known(&all), Some(&candidates), &ignore_progress).unwrap();
    assert!(good(&with_candidates) > good(&guided), "{} with candidates", good(&with_candidates));
}

#[test]
fn arguments_that_do_not_match_are_refused_by_name() {
    let stepper = Stepper::new(&scene(), &options()).unwrap();
    let first = run_cycle(&stepper, 0, &[], &InMemory);
    let message = |error: Error| error.to_string();
    let search = |cycle, view, estimates: &[Option<&ViewEstimate<Checked>>]| {
        message(stepper.search(cycle, view, estimates, None, &ignore_progress).unwrap_err())
    };
    assert!(search(9, 0, &[]).starts_with("cycle is 9"), "{}", search(9, 0, &[]));
    assert!(search(0, 4, &[]).starts_with("view is 4"));
    assert!(search(1, 0, &known(&first)[..2]).starts_with("estimates is 2 entries"));
    assert!(
        search(1, 0, &[Some(&first[1]), None, None, None])
            .starts_with("estimates[0] is the estimate of view 1")
    );
    assert!(search(3, 0, &known(&first)).contains("upsampled"));
    assert!(message(stepper.upsample(1, &first[0]).unwrap_err()).contains("the scale before"));
    assert!(
        message(stepper.finish(0, &known(&first), &ignore_progress).unwrap_err()).contains("estimates[0]")
    );
    let searched = stepper.search(1, 0, &known(&first), None, &ignore_progress).unwrap();
    let check = |sources: &[Option<EstimateRef>]| message(stepper.check(&searched, sources).unwrap_err());
    assert!(check(&[None]).starts_with("estimates is 1 entries"));
    assert!(
        check(&[None, Some((&first[0]).into()), None, None])
            .starts_with("estimates[1] is the estimate of view 0")
    );
    let fine = stepper.upsample(3, &first[1]).unwrap();
    assert!(check(&[None, Some((&fine).into()), None, None]).contains("on the scale of cycle 1"));
    let cancelled = stepper.search(0, 0, &[], None, &|_| ControlFlow::Break(()));
    assert_eq!(cancelled.unwrap_err(), Error::Cancelled);

    let candidates = stepper.propagate(1, 0, &known(&first)).unwrap();
    let search = |cycle, view, candidates: &Candidates| {
        let estimates = known(&first);
        stepper.search(cycle, view, &estimates, Some(candidates), &ignore_progress).map(drop).map_err(message)
    };
    assert!(search(1, 0, &candidates).is_ok());
    assert!(search(1, 1, &candidates).unwrap_err().starts_with("candidates is those of view 0 in cycle 1"));
    assert!(search(0, 0, &candidates).unwrap_err().contains("those of view 0 in cycle 0"));
}

#[test]
fn damaged_or_foreign_bytes_are_no_estimate() {
    let stepper = Stepper::new(&scene(), &options()).unwrap();
    let read = |bytes: &[u8]| AnyEstimate::from_bytes(&stepper, bytes).map(drop);
    let bytes = stepper.search(0, 1, &[], None, &ignore_progress).unwrap().to_bytes();
    assert!(read(&bytes).is_ok());
    for cut in (0..bytes.len()).step_by(bytes.len() / 50 + 1) {
        assert!(read(&bytes[..cut]).is_err(), "cut to {cut} bytes");
    }
    assert!(read(&[&bytes[..], &[0]].concat()).is_err());
    for place in 0..80 {
        let mut changed = bytes.clone();
        changed[place] ^= 0x80;
        // Counts may be any number; everything else in the header is checked against the scene.
        assert!(read(&changed).is_err() || (56..80).contains(&place), "byte {place}");
    }
    let mut not_a_number = bytes.clone();
    let depth = bytes.len() - 26 * 64 * 48;
    not_a_number[depth..depth + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(read(&not_a_number).unwrap_err().to_string().contains("column 0, row 0"));
    // The last pixel: its flag, which only a check sets, and a bit of a view set beyond the source list.
    for (place, value) in [(bytes.len() - 5, 1), (bytes.len() - 1, 0x80)] {
        let mut changed = bytes.clone();
        changed[place] |= value;
        assert!(read(&changed).is_err(), "byte {place}");
    }
    let other =
        Stepper::new(&procedural::plane_and_sphere().only(&[0, 1]).scene(), &Options::paper()).unwrap();
    assert!(AnyEstimate::from_bytes(&other, &bytes).is_err());
}
