//! What `report.json` will say, as far as it is known while a run goes on.

use super::json::{CycleReport, by_name, total_cycles, typed};
use serde_json::{Map, Value, json};
use skep::PixelStatus;
use skep::io::ColmapModel;
use skep::job::{RunState, ViewState};

/// The keys of `report.json` that are known; the others are missing.
pub fn report(state: &RunState, model: &ColmapModel) -> Value {
    let views: Vec<Value> = state.views.iter().map(|view| view_report(view, model)).collect();
    let finished = || state.views.iter().filter_map(|view| view.finished.as_ref());
    let mut counts = [0; PixelStatus::ALL.len()];
    for view in finished() {
        counts.iter_mut().zip(view.status_counts).for_each(|(total, count)| *total += count);
    }
    let cycles = total_cycles(state.views.iter().flat_map(|view| &view.cycles));
    let options: Map<String, Value> =
        state.options.values().map(|(name, value)| (name.to_owned(), typed(value))).collect();
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "options": options,
        "warnings": [],
        "totals": {
            "pixels": counts.iter().sum::<u64>(),
            "status_counts": by_name(counts),
            "cycles": cycles,
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
        "cycles": view.cycles.iter().map(CycleReport::of_view).collect::<Vec<_>>(),
    });
    if let Some(finished) = &view.finished {
        report["status_counts"] = json!(by_name(finished.status_counts));
        report["ncc_evaluations"] = finished.counts.ncc_evaluations.into();
    }
    report
}
