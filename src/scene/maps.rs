//! Depth and normal maps of a view, and the status of each pixel.

/// Depth and normal of every pixel of a view, row by row.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Maps {
    /// Depth in world units, 0 where there is none.
    pub depth: Vec<f32>,
    /// Unit normal in the view's camera frame, facing the camera; zeros where there is no depth.
    pub normal: Vec<[f32; 3]>,
}

/// What became of a pixel, and the reason when it has no validated solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum PixelStatus {
    /// The solution is consistent with enough source views.
    Validated,
    /// The mask leaves the pixel out.
    Masked,
    /// The window around the pixel is too uniform to be matched.
    NoTexture,
    /// Fewer than two source views can see the solution.
    NoSources,
    /// Too few source views agree with the solution.
    Inconsistent,
    /// The solution lies at an end of the depth range: the surface may lie beyond.
    OutOfRange,
}

impl PixelStatus {
    /// All outcomes, in the order of their discriminants.
    pub const ALL: [PixelStatus; 6] = [
        PixelStatus::Validated,
        PixelStatus::Masked,
        PixelStatus::NoTexture,
        PixelStatus::NoSources,
        PixelStatus::Inconsistent,
        PixelStatus::OutOfRange,
    ];

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            PixelStatus::Validated => "validated",
            PixelStatus::Masked => "masked",
            PixelStatus::NoTexture => "no_texture",
            PixelStatus::NoSources => "no_sources",
            PixelStatus::Inconsistent => "inconsistent",
            PixelStatus::OutOfRange => "out_of_range",
        }
    }
}
