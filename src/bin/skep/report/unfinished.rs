//! What `report.json` will say, as far as it is known while a run goes on.

use super::json::{by_name, typed};
use serde_json::{Map, Value, json};
use skep::io::ColmapModel;
use skep::job::{RunState, ViewState};
use skep::{CycleRecord, PixelStatus};

/// The keys of `report.json` that are known; the others are missing.
pub fn report(state: &RunState, model: &ColmapModel) -> Value {
    let views: Vec<Value> = state.views.iter().map(|view| view_report(view, model)).collect();
    let finished = || state.views.iter().filter_map(|view| view.finished.as_ref());
    let mut counts = [0; PixelStatus::ALL.len()];
    for view in finished() {
        counts.iter_mut().zip(view.status_counts).for_each(|(total, count)| *total += count);
    }
    let mut cycles: Vec<CycleRecord> = Vec::new();
    for cycle in state.views.iter().flat_map(|view| &view.cycles) {
        let same =
            |total: &&mut CycleRecord| (total.downscale, total.cycle) == (cycle.downscale, cycle.cycle);
        match cycles.iter_mut().find(same) {
            Some(total) => {
                total.pixels += cycle.pixels;
                total.changed += cycle.changed;
                total.validated += cycle.validated;
            }
            None => cycles.push(*cycle),
        }
    }
    cycles.sort_by_key(|cycle| (std::cmp::Reverse(cycle.downscale), cycle.cycle));
    let options: Map<String, Value> =
        state.options.values().map(|(name, value)| (name.to_owned(), typed(value))).collect();
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "options": options,
        "warnings": [],
        "totals": {
            "pixels": counts.iter().sum::<u64>(),
            "status_counts": by_name(counts),
            "cycles": cycles.iter().map(cycle_report).collect::<Vec<_>>(),
            "points": state.points,
        },
        "views": views,
    })
}

fn view_report(view: &ViewState, model: &ColmapModel) -> Value {
    let camera = model.images.iter().find(|image| image.name == view.name).map(|image| image.camera);
    let mut report = json!({
        "name": view.name,
        "width": camera.map(|camera| camera.width),
        "height": camera.map(|camera| camera.height),
        "pixels": camera.map(|camera| camera.pixels()),
        "cycles": view.cycles.iter().map(cycle_report).collect::<Vec<_>>(),
    });
    if let Some(finished) = &view.finished {
        report["status_counts"] = json!(by_name(finished.status_counts));
        report["ncc_evaluations"] = finished.counts.ncc_evaluations.into();
    }
    report
}

fn cycle_report(cycle: &CycleRecord) -> Value {
    let &CycleRecord { downscale, cycle, pixels, changed, validated, median_residual } = cycle;
    json!({
        "downscale": downscale,
        "cycle": cycle,
        "pixels": pixels,
        "changed": changed,
        "validated": validated,
        "median_residual": median_residual,
    })
}
