//! Work done by the search, in counts that do not depend on the machine.

/// Counts of the work done; they depend on input and options only, not on the machine.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Patches compared with a patch in one source view.
    pub ncc_evaluations: u64,
    /// Bilinear samples taken from source views.
    pub bilinear_samples: u64,
    /// Hypotheses given up before all their source views were looked at.
    pub early_terminations: u64,
}

impl std::ops::AddAssign for Counts {
    fn add_assign(&mut self, other: Counts) {
        self.ncc_evaluations += other.ncc_evaluations;
        self.bilinear_samples += other.bilinear_samples;
        self.early_terminations += other.early_terminations;
    }
}
