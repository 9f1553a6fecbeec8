//! What `--log-level debug` prints of a planned run.

use skep::job::Job;
use skep::simd::SimdLevel;
use skep::{Options, thread_count};

/// The program, the options that are not those of the default preset, and the photographs with their depth
/// ranges and source views.
pub fn details(job: &Job) -> Vec<String> {
    let (scene, options) = (job.scene(), job.options());
    let version = env!("CARGO_PKG_VERSION");
    let level = options.simd.unwrap_or_else(SimdLevel::detect).name();
    let mut lines =
        vec![format!("skep {version}, SIMD level {level}, {} threads", thread_count(scene, options))];
    let default = Options::default();
    let changed = options.values().zip(default.values()).filter(|(own, usual)| own != usual);
    lines.extend(changed.map(|((name, value), (_, usual))| format!("{name}={value}, by default {usual}")));
    for (index, view) in scene.views().iter().enumerate() {
        let (camera, range) = (&view.camera, scene.depth_range(index));
        let sources: Vec<&str> = job
            .stepper()
            .sources(index)
            .iter()
            .map(|&source| scene.views()[source as usize].name.as_str())
            .collect();
        lines.push(format!(
            "view {index}, {}: {} x {} pixels, depths {} to {}, sources {}",
            view.name,
            camera.width,
            camera.height,
            range.near,
            range.far,
            sources.join(", ")
        ));
    }
    lines
}
