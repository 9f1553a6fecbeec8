//! The estimate of the remaining time.

use std::time::{Duration, Instant};

/// Fraction of the run below which the estimate is too uncertain to show.
const FIRST_ESTIMATE: f64 = 0.01;
/// Progress at once that may be work that was skipped: cycles of a scale that ended early, or what an earlier
/// run did.
const LEAST_SKIP: f64 = 0.005;
/// It is, if it is so many times what the rate up to then makes of the time that went by.
const SKIP_FACTOR: f64 = 8.0;

/// Estimates the remaining time from the work done and the time it took, without the work that was skipped.
#[derive(Debug, Clone, Copy)]
pub struct TimeLeft {
    started: Instant,
    /// The fraction that took no time.
    skipped: f64,
    last: Option<(Instant, f64)>,
}

impl TimeLeft {
    /// Starts the clock.
    pub fn start() -> TimeLeft {
        TimeLeft { started: Instant::now(), skipped: 0.0, last: None }
    }

    /// The seconds that are left when a fraction is done; `None` while too little is done for an estimate.
    pub fn update(&mut self, done: f64, now: Instant) -> Option<f64> {
        let (before, done_before) = match self.last {
            Some(last) => last,
            // Of an earlier run that this one goes on with.
            None => {
                self.skipped = done;
                (now, done)
            }
        };
        let rate = (done_before - self.skipped) / seconds(self.started, before);
        let added = done - done_before;
        if added > LEAST_SKIP && rate > 0.0 && added > SKIP_FACTOR * rate * seconds(before, now) {
            self.skipped += added;
        }
        self.last = Some((now, done));
        let own = done - self.skipped;
        (own >= FIRST_ESTIMATE).then(|| seconds(self.started, now) * (1.0 - done.min(1.0)) / own)
    }
}

fn seconds(from: Instant, to: Instant) -> f64 {
    to.saturating_duration_since(from).max(Duration::from_micros(1)).as_secs_f64()
}

/// A time such as `0:41` or `1:02:05`.
pub fn clock(seconds: f64) -> String {
    let seconds = seconds.round() as u64;
    let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    match hours {
        0 => format!("{minutes}:{seconds:02}"),
        _ => format!("{hours}:{minutes:02}:{seconds:02}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The estimates at these times (seconds) and fractions.
    fn estimates(reports: &[(f64, f64)]) -> Vec<Option<f64>> {
        let mut time_left = TimeLeft::start();
        let started = time_left.started;
        let at = |&(time, done): &(f64, f64)| time_left.update(done, started + Duration::from_secs_f64(time));
        reports.iter().map(at).collect()
    }

    #[test]
    fn the_time_left_follows_from_the_fraction_done_and_the_time_elapsed() {
        let found = estimates(&[(0.0, 0.0), (1.0, 0.005), (20.0, 0.1), (100.0, 0.5), (200.0, 1.0)]);
        assert_eq!(found[..2], [None, None], "too early");
        let rounded: Vec<f64> = found[2..].iter().map(|left| left.unwrap().round()).collect();
        assert_eq!(rounded, [180.0, 100.0, 0.0]);
    }

    #[test]
    fn what_took_no_time_does_not_count() {
        // Half was done by an earlier run; then a tenth is skipped at once.
        let found = estimates(&[(0.0, 0.5), (10.0, 0.6), (10.1, 0.7), (20.0, 0.8)]);
        assert_eq!(found[0], None);
        assert_eq!(found[1].unwrap().round(), 40.0);
        assert_eq!(found[2].unwrap().round(), 30.0);
        assert_eq!(found[3].unwrap().round(), 20.0);
    }

    #[test]
    fn times_are_read_as_on_a_clock() {
        assert_eq!([0.4, 41.2, 3725.0].map(clock), ["0:00", "0:41", "1:02:05"]);
    }
}
