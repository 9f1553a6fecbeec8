//! A run taken apart: the same bits as the whole, with states that travel as bytes, and maps of the host's own.

mod common;

use common::changed;
use common::procedural;
use skep::{
    Candidates, Error, Options, OwnMaps, Reconstruction, Scale, Scene, Stepper, ViewEstimate, ignore_progress,
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

fn some(states: &[ViewEstimate]) -> Vec<Option<&ViewEstimate>> {
    states.iter().map(Some).collect()
}

/// One step of all views by hand, the last view first; `travel` is what happens to each state on its way.
fn step_all(
    steps: &Stepper,
    step: usize,
    states: &[ViewEstimate],
    travel: &dyn Fn(ViewEstimate) -> ViewEstimate,
) -> Vec<ViewEstimate> {
    let search = |view: usize| {
        let offers = steps.propagate(step, view, &some(states)).unwrap();
        travel(steps.search(step, view, &some(states), Some(&offers), &ignore_progress).unwrap())
    };
    let mut searched: Vec<ViewEstimate> = (0..steps.views()).rev().map(search).collect();
    searched.reverse();
    let verdicts: Vec<_> =
        (0..steps.views()).rev().map(|view| steps.check(step, view, &some(&searched)).unwrap()).collect();
    for (view, verdicts) in verdicts.iter().rev().enumerate() {
        steps.mark(view, &mut searched[view], verdicts).unwrap();
    }
    searched.into_iter().map(travel).collect()
}

fn by_hand(steps: &Stepper, travel: &dyn Fn(ViewEstimate) -> ViewEstimate) -> Vec<ViewEstimate> {
    let mut states = Vec::new();
    let mut next = Some(0);
    while let Some(step) = next {
        states = step_all(steps, step, &states, travel);
        next = steps.next(step, &some(&states)).unwrap();
        if let Some(next) = next.filter(|&next| steps.size(next, 0) != steps.size(step, 0)) {
            states = (states.iter().enumerate())
                .map(|(view, state)| travel(steps.upsample(next, view, state).unwrap()))
                .collect();
        }
    }
    states
}

fn assert_same(steps: &Stepper, states: &[ViewEstimate], whole: &Reconstruction) {
    for (view, expected) in whole.views.iter().enumerate() {
        let found = steps.finish(view, &some(states), &ignore_progress).unwrap();
        assert_eq!(found.estimate, expected.estimate, "maps of view {view}");
        assert_eq!(found.status, expected.status);
        assert_eq!(found.cost, expected.cost);
        assert_eq!(found.view_sets, expected.view_sets);
        assert_eq!(found.sources, expected.sources);
        assert_eq!((found.counts, found.cycles), (expected.counts, expected.cycles.clone()));
    }
}

#[test]
fn steps_by_hand_give_the_bits_of_the_whole_run() {
    let (scene, options) = (scene(), options());
    let whole = skep::reconstruct(&scene, &options, &ignore_progress).unwrap();
    assert!(whole.views[0].status_counts()[0] > 5000);
    let steps = Stepper::new(&scene, &options).unwrap();
    assert_same(&steps, &by_hand(&steps, &|state| state), &whole);
    let travel = |state: ViewEstimate| ViewEstimate::from_bytes(&steps, &state.to_bytes()).unwrap();
    assert_same(&steps, &by_hand(&steps, &travel), &whole);
}

#[test]
fn a_scale_that_has_settled_is_left() {
    let options = changed(options(), |o| {
        o.schedule.min_changed_fraction = 1.0;
    });
    let steps = Stepper::new(&scene(), &options).unwrap();
    let cycles: Vec<(u32, u32)> =
        by_hand(&steps, &|state| state)[0].cycles().iter().map(|c| (c.downscale, c.cycle)).collect();
    // The first cycle changes every pixel; the second settles, whatever it changes.
    assert_eq!(cycles, [(2, 0), (2, 1), (1, 0), (1, 1)]);
}

#[test]
fn maps_of_the_host_s_own_validate_and_guide_another_view() {
    let made = procedural::plane_and_sphere().only(&[0, 1, 2, 3]);
    let scene = made.scene();
    let options = changed(options(), |o| {
        o.schedule.scales = vec![options().schedule.scales[1]];
    });
    let steps = Stepper::new(&scene, &options).unwrap();
    let own = |view: usize| {
        let own = OwnMaps { maps: &made.truth[view], validated: None, cost: None };
        ViewEstimate::from_maps(&steps, 1, view, &own).unwrap()
    };
    let neighbors: Vec<ViewEstimate> = (0..4).map(own).collect();
    // View 0 knows nothing of itself: all it has is what the others' maps offer and vouch for.
    let alone = steps.search(1, 0, &[], None, &ignore_progress).unwrap();
    let states = [None, Some(&neighbors[1]), Some(&neighbors[2]), Some(&neighbors[3])];
    let helped = steps.search(1, 0, &states, None, &ignore_progress).unwrap();
    let good = |state: &ViewEstimate| {
        let truth = made.truth[0].depth.iter().zip(state.maps().depth);
        truth.filter(|(truth, depth)| (*depth / **truth - 1.0).abs() < 0.01).count()
    };
    assert!(good(&helped) > good(&alone), "{} with neighbors, {} without", good(&helped), good(&alone));
    let mut offered = neighbors.clone();
    let costs: Vec<f32> = helped.cost().collect();
    offered[0] = ViewEstimate::from_maps(
        &steps,
        1,
        0,
        &OwnMaps { maps: &helped.maps(), validated: Some(&vec![false; helped.pixels()]), cost: Some(&costs) },
    )
    .unwrap();
    let offers = steps.propagate(1, 0, &some(&offered)).unwrap();
    let with_offers = steps.search(1, 0, &some(&offered), Some(&offers), &ignore_progress).unwrap();
    assert!(good(&with_offers) > good(&helped), "{} with offers", good(&with_offers));
}

#[test]
fn what_does_not_belong_together_is_refused_by_name() {
    let steps = Stepper::new(&scene(), &options()).unwrap();
    let first = step_all(&steps, 0, &[], &|state| state);
    let message = |error: Error| error.to_string();
    let search = |step, view, states: &[Option<&ViewEstimate>]| {
        message(steps.search(step, view, states, None, &ignore_progress).unwrap_err())
    };
    assert!(search(9, 0, &[]).starts_with("step is 9"), "{}", search(9, 0, &[]));
    assert!(search(0, 4, &[]).starts_with("view is 4"));
    assert!(search(1, 0, &some(&first)[..2]).starts_with("states is 2 entries"));
    assert!(
        search(1, 0, &[Some(&first[1]), None, None, None]).starts_with("states[0] is the state of view 1")
    );
    assert!(search(3, 0, &some(&first)).contains("handed up"));
    let searched = steps.search(1, 0, &some(&first), None, &ignore_progress).unwrap();
    let unchecked = [Some(&searched), None, None, None];
    assert!(search(1, 0, &unchecked).contains("not yet checked"));
    assert!(message(steps.check(0, 0, &some(&first)).unwrap_err()).starts_with("states[0] is checked"));
    assert!(message(steps.check(1, 0, &[]).unwrap_err()).starts_with("states[0] is none"));
    assert!(message(steps.upsample(1, 0, &first[0]).unwrap_err()).contains("the scale before"));
    assert!(message(steps.upsample(3, 1, &first[0]).unwrap_err()).contains("view 1"));
    assert!(message(steps.finish(0, &some(&first), &ignore_progress).unwrap_err()).contains("states[0]"));
    assert!(message(steps.next(0, &unchecked).unwrap_err()).contains("not yet checked"));
    let mut marked = first[0].clone();
    let verdicts = steps.check(1, 0, &unchecked).unwrap();
    assert!(steps.mark(0, &mut marked, &verdicts).is_err());
    let cancelled = steps.search(0, 0, &[], None, &|_| ControlFlow::Break(()));
    assert_eq!(cancelled.unwrap_err(), Error::Cancelled);
    let offers = steps.propagate(1, 0, &some(&first)).unwrap();
    let search = |step, view, offers: &Candidates| {
        steps.search(step, view, &some(&first), Some(offers), &ignore_progress).map(drop).map_err(message)
    };
    assert!(search(1, 0, &offers).is_ok());
    assert!(search(1, 1, &offers).unwrap_err().starts_with("offers is offers to view 0 for step 1"));
    assert!(search(0, 0, &offers).unwrap_err().contains("those to view 0 for step 0"));
}

#[test]
fn damaged_or_foreign_bytes_are_no_state() {
    let steps = Stepper::new(&scene(), &options()).unwrap();
    let bytes = steps.search(0, 1, &[], None, &ignore_progress).unwrap().to_bytes();
    assert!(ViewEstimate::from_bytes(&steps, &bytes).is_ok());
    for cut in (0..bytes.len()).step_by(bytes.len() / 50 + 1) {
        assert!(ViewEstimate::from_bytes(&steps, &bytes[..cut]).is_err(), "cut to {cut} bytes");
    }
    let longer = [&bytes[..], &[0]].concat();
    assert!(ViewEstimate::from_bytes(&steps, &longer).is_err());
    for place in 0..80 {
        let mut changed = bytes.clone();
        changed[place] ^= 0x80;
        // Counts may be any number; everything else in the header is checked against the scene.
        assert!(
            ViewEstimate::from_bytes(&steps, &changed).is_err() || (56..80).contains(&place),
            "byte {place}"
        );
    }
    let mut not_a_number = bytes.clone();
    let depth = bytes.len() - 26 * 64 * 48;
    not_a_number[depth..depth + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(
        ViewEstimate::from_bytes(&steps, &not_a_number).unwrap_err().to_string().contains("column 0, row 0")
    );
    let other =
        Stepper::new(&procedural::plane_and_sphere().only(&[0, 1]).scene(), &Options::paper()).unwrap();
    assert!(ViewEstimate::from_bytes(&other, &bytes).is_err());
}
